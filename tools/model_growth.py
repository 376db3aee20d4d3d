#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Meshes the diamond finer and finer, times a refresh on each mesh, with a factor for each pose and with one that is
reused, and leaves tables and a picture."""

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
POSES = (60, 40, 24, 10)  # for each distance of the tip


def make_mesh(scale, out):
    folder = out / f"scale-{scale:g}"
    mesh = folder / "diamond.msh"
    if not mesh.exists():
        subprocess.run([ROOT / "tools/mesh-robots", "diamond", "--out", folder, "--scale", str(scale)], check=True,
                       stdout=subprocess.DEVNULL)
    return mesh


def run(command):
    answer = subprocess.run([str(c) for c in command], check=True, stdout=subprocess.PIPE, text=True)
    return answer.stdout.splitlines()


def measure_refresh(mesh, repetitions, programs, prefix):
    # Small efforts: a cable pulls at one tetrahedron, however small that is.
    lines = run([*prefix, programs / "model_benchmark", ROOT / "config/diamond.yaml", "--mesh", mesh, "--repetitions",
                 repetitions, "--share", "0.002", "--no-yardsticks", "--json"])
    return json.loads(lines[-1])


def measure_reuse(mesh, poses, programs, prefix):
    lines = run([*prefix, programs / "reuse_benchmark", ROOT / "config/diamond.yaml", "--mesh", mesh, "--poses", poses])
    return [json.loads(line) for line in lines]


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


def reuse_table(reuse):
    yield ("| nodes | tip from pose to pose, mm | a factor for each pose, ms | reused, ms | times as fast | sweeps | "
           "poses for one factor | error of W |")
    yield "| --- | --- | --- | --- | --- | --- | --- | --- |"
    for rows in reuse:
        for r in rows:
            yield (f"| {r['nodes']} | {r['distance_mm']:g} | {r['direct_ms']:.1f} | {r['reused_ms']:.1f} | "
                   f"{r['ratio']:.2f} | {r['sweeps']:.1f} | {r['poses_per_factorisation']:.1f} | "
                   f"{r['error_of_W']:.0e} |")


def break_even(rows):
    """Distance of the tip at which reusing takes as long as factoring, from one that still pays to the next, mm."""
    before = None
    for r in rows:
        if r["ratio"] < 1:
            if before is None:
                return f"below {r['distance_mm']:g} mm"
            share = (before["ratio"] - 1) / (before["ratio"] - r["ratio"])
            return f"{before['distance_mm'] + share * (r['distance_mm'] - before['distance_mm']):.2g} mm"
        before = r
    return f"beyond {before['distance_mm']:g} mm"


def picture(rows, reuse, path):
    figure, (growth, gain) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
    draw_growth(rows, growth)
    for measured in reuse:
        gain.semilogx([r["distance_mm"] for r in measured], [r["ratio"] for r in measured], "o-",
                      label=f"{measured[0]['nodes']} nodes")
    gain.axhline(1, linestyle=":", color="grey")
    gain.set_xlabel("way of the tip from pose to pose, mm")
    gain.set_ylabel("a factor for each pose / reused, times")
    gain.grid(True, which="both", alpha=0.3)
    gain.legend()
    figure.savefig(path, dpi=150)


def draw_growth(rows, axes):
    nodes = np.array([r["nodes"] for r in rows])
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


def main():
    parser = argparse.ArgumentParser(prog="model_growth", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--programs", type=Path, required=True, help="the folder of the programs that measure")
    parser.add_argument("prefix", nargs="*", help="what they are run with, e.g. taskset")
    arguments = parser.parse_args()
    rows, reuse = [], []
    for scale, repetitions, poses in zip(SCALES, REPETITIONS, POSES):
        print(f"edge length x {scale:g} ...", file=sys.stderr, flush=True)
        mesh = make_mesh(scale, arguments.out)
        rows.append(measure_refresh(mesh, repetitions, arguments.programs, arguments.prefix))
        reuse.append(measure_reuse(mesh, poses, arguments.programs, arguments.prefix))
    print(*table(rows), "", *reuse_table(reuse), sep="\n")
    print("\nReusing the factor pays up to a way of the tip from pose to pose")
    for measured in reuse:
        print(f"  {break_even(measured)} on {measured[0]['nodes']} nodes")
    picture(rows, reuse, arguments.out / "growth.png")
    figures = {"refresh": rows, "reuse": reuse}
    (arguments.out / "growth.json").write_text(json.dumps(figures, indent=1) + "\n")
    print(f"\n{arguments.out / 'growth.png'}")


if __name__ == "__main__":
    main()
