#!/usr/bin/python3
"""Meshes the diamond finer and finer, times a refresh on each mesh, and leaves a table and a picture of the growth."""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
# Edge lengths relative to the robot's own, for about 1 600, 6 000, 25 000 and 100 000 nodes.
SCALES = (1.0, 0.48, 0.26, 0.148)
REPETITIONS = (100, 30, 8, 3)


def measure(scale, repetitions, out, benchmark):
    folder = out / f"scale-{scale:g}"
    mesh = folder / "diamond.msh"
    if not mesh.exists():
        subprocess.run([ROOT / "tools/mesh-robots", "diamond", "--out", folder, "--scale", str(scale)], check=True,
                       stdout=subprocess.DEVNULL)
    # Small efforts: a cable pulls at one tetrahedron, however small that is.
    command = [*benchmark, ROOT / "config/diamond.yaml", "--mesh", mesh, "--repetitions", str(repetitions),
               "--share", "0.002", "--no-yardsticks", "--json"]
    answer = subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True)
    return json.loads(answer.stdout.splitlines()[-1])


def exponents(nodes, values):
    """Of value = c · nodes^p between neighbouring sizes."""
    return np.diff(np.log(values)) / np.diff(np.log(nodes))


def table(rows):
    nodes = [r["nodes"] for r in rows]
    times = [r["refresh_ms"]["median"] for r in rows]
    orders = ["", *(f"{p:.2f}" for p in exponents(nodes, times))]
    yield "| nodes | tetrahedra | refresh, ms | assemble | factor and compliance | move | exponent | memory, MiB |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- |"
    for r, order in zip(rows, orders):
        s = r["split_ms"]
        yield (f"| {r['nodes']} | {r['tetrahedra']} | {r['refresh_ms']['median']:.1f} | {s['assemble']:.1f} | "
               f"{s['factor_and_compliance']:.1f} | {s['move']:.1f} | {order} | {r['peak_memory_mib']:.0f} |")


def picture(rows, path):
    nodes = np.array([r["nodes"] for r in rows])
    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for label, values in (("whole refresh", [r["refresh_ms"]["median"] for r in rows]),
                          ("factor and compliance", [r["split_ms"]["factor_and_compliance"] for r in rows]),
                          ("assemble", [r["split_ms"]["assemble"] for r in rows])):
        axes.loglog(nodes, values, "o-", label=label)
    first = rows[0]["refresh_ms"]["median"]
    axes.loglog(nodes, first * (nodes / nodes[0]), ":", color="grey", label="∝ nodes")
    axes.loglog(nodes, first * (nodes / nodes[0]) ** 2, "--", color="grey", label="∝ nodes²")
    axes.set_xlabel("nodes of the diamond's mesh")
    axes.set_ylabel("time, ms")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=150)


def main():
    parser = argparse.ArgumentParser(prog="model_growth", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("benchmark", nargs="+", help="the program that times a refresh, with what runs it")
    arguments = parser.parse_args()
    rows = []
    for scale, repetitions in zip(SCALES, REPETITIONS):
        print(f"edge length x {scale:g} ...", file=sys.stderr, flush=True)
        rows.append(measure(scale, repetitions, arguments.out, arguments.benchmark))
    print(*table(rows), sep="\n")
    picture(rows, arguments.out / "growth.png")
    (arguments.out / "growth.json").write_text(json.dumps(rows, indent=1) + "\n")
    print(f"\n{arguments.out / 'growth.png'}")


if __name__ == "__main__":
    main()
