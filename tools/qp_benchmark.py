# SPDX-License-Identifier: Apache-2.0
"""Replays recorded and generated control cycles through the QP solver and tabulates time, instructions and faults.

Called by tools/bench. Instructions are counted by callgrind, which runs the same replay once more: it collects inside
Solver::solve alone and writes what it has whenever the clock is read, which happens around each solve. Such counts are
exact; two runs give the same ones.
"""

import argparse
import json
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

SOLVE = "tendril::qp::Solver::solve*"
CLOCK = "tendril::rt::now_ns*"

# The least median and the least maximum of instructions among ten public solvers, each in its best mode: the table in
# the README.md of the recorded sequences.
BEST_PUBLIC = {
    "track_m04e03_s0": (322, 2736),
    "reach_m04e03_s0": (2595, 8690),
    "track_m08e06_s0": (1157, 8757),
    "reach_m08e06_s0": (4768, 32667),
}

COLUMNS = (f"{'set':<21} {'mode':<4} {'iterations':>10} {'us median':>10} {'99.9 %':>7} {'max':>7} "
           f"{'instructions':>12} {'max':>8} {'at tick':>13} {'best public':>13} "
           f"{'CGAL us':>8} {'max':>6} {'faults':>6}")


def fail(code, what):
    print(f"bench: {what}", file=sys.stderr)
    sys.exit(code)


def run(*command):
    ended = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        fail(1, f"{' '.join(map(str, command))} ended with {ended.returncode}: {ended.stderr.strip()}")
    return ended.stdout


def count_instructions(program, sequence, mode, ticks):
    """Instructions of each solve, in order."""
    with tempfile.TemporaryDirectory() as folder:
        counts = Path(folder) / "counts"
        run("valgrind", "--tool=callgrind", f"--callgrind-out-file={counts}", "--combine-dumps=yes",
            f"--toggle-collect={SOLVE}", f"--dump-before={CLOCK}", program, "--silent", *mode, sequence)
        parts = [int(number) for number in re.findall(r"^summary: (\d+)$", counts.read_text(), re.MULTILINE)]
    solves = [number for number in parts if number > 0]  # nothing is collected before a solve and at the end
    if len(solves) == ticks + 1:  # before the clock was read for the first time: the references of a generated sequence
        solves = solves[1:]
    if len(solves) != ticks:
        fail(1, f"callgrind saw {len(solves)} solves in {sequence}, which has {ticks} ticks")
    return solves


def rank(values, share):
    """The smallest value that at least this share of all do not exceed."""
    return sorted(values)[max(math.ceil(share * len(values)) - 1, 0)]


def measure(program, sequence, mode):
    raw = json.loads(run(program, *mode, sequence))
    instructions = count_instructions(program, sequence, mode, len(raw["ns"]))
    us = [ns / 1000 for ns in raw["ns"]]
    worst = instructions.index(max(instructions))
    at = "start" if worst == 0 else "swap" if worst in raw["swaps"] else "plain"
    cgal_us = [ns / 1000 for ns in raw["cgal_ns"]]
    return {
        "name": raw["name"], "m": raw["m"], "e": raw["e"], "mode": raw["mode"], "ticks": len(us),
        "instr_median": rank(instructions, 0.5), "instr_max": instructions[worst],
        "instr_max_tick": worst, "instr_max_at": at,
        "us_median": rank(us, 0.5), "us_p999": rank(us, 0.999), "us_max": max(us), "clock_us": raw["clock_ns"] / 1000,
        "iterations_median": rank(raw["iterations"], 0.5), "iterations_max": max(raw["iterations"]),
        "cgal_us_median": rank(cgal_us, 0.5) if cgal_us else None, "cgal_us_max": max(cgal_us, default=None),
        "failures": len(raw["faults"]), "faults": raw["faults"][:3],
    }


def print_row(row):
    iterations = f"{row['iterations_median']} / {row['iterations_max']}"
    where = f"{row['instr_max_tick']} {row['instr_max_at']}"
    best = "{} / {}".format(*BEST_PUBLIC[row["name"]]) if row["name"] in BEST_PUBLIC else ""
    cgal = f"{row['cgal_us_median']:>8.0f} {row['cgal_us_max']:>6.0f}" if row["cgal_us_max"] else f"{'':>15}"
    print(f"{row['name']:<21} {row['mode']:<4} {iterations:>10} {row['us_median']:>10.3f} {row['us_p999']:>7.2f} "
          f"{row['us_max']:>7.2f} {row['instr_median']:>12} {row['instr_max']:>8} {where:>13} {best:>13} "
          f"{cgal} {row['failures'] or '':>6}", flush=True)
    for fault in row["faults"]:
        print(f"  tick {fault['tick']}: {fault['what']}")
    if row["failures"] > len(row["faults"]):
        print(f"  and {row['failures'] - len(row['faults'])} more")


def main():
    parser = argparse.ArgumentParser(prog="tools/bench qp", description=__doc__)
    parser.add_argument("--program", type=Path, required=True, help="qp_benchmark")
    parser.add_argument("--sets", default="", metavar="REGEX", help="of the sequences' names")
    parser.add_argument("--cold", action="store_true", help="also with an empty working set at each tick")
    parser.add_argument("--json", action="store_true", help="the last line is JSON")
    options = parser.parse_args()

    try:
        wanted = re.compile(options.sets)
    except re.error as error:
        fail(2, f"--sets {options.sets}: {error}")
    found = [Path(line) for line in run(options.program, "--list").splitlines()]
    if not any(file.suffix for file in found):
        print("bench: there are no recorded sequences, only generated ones: point the CMake variable TENDRIL_SHARED_DATA to "
              "a folder with qp/*.qps", file=sys.stderr)
    sequences = [file for file in found if wanted.search(file.stem)]
    if not sequences:
        fail(2, f"no sequence has a name with {options.sets} in it; there are {', '.join(file.stem for file in found)}")

    print(COLUMNS)
    rows = []
    for sequence in sequences:
        for mode in ([], ["--cold"]) if options.cold else ([],):
            rows.append(measure(options.program, sequence, mode))
            print_row(rows[-1])
    worst = max(rows, key=lambda row: row["instr_max"])
    failures = sum(row["failures"] for row in rows)
    print(f"Most instructions: {worst['instr_max']}, {worst['name']} {worst['mode']}, tick {worst['instr_max_tick']} "
          f"({worst['instr_max_at']}). A swap is the first tick on a new snapshot, the start the first of all.")
    if any(row["cgal_us_max"] for row in rows):
        print("CGAL: its QP_solver, which the paper used, in exact arithmetic (Gmpzf) on 50 of the ticks where H is regular.")
    else:
        print("CGAL: not built in (libcgal-dev), or H is singular in all of these.")
    print(f"Faults: {failures} in {sum(row['ticks'] for row in rows)} solves. "
          f"The times contain {max(row['clock_us'] for row in rows):.3f} us of the clock's own.")
    if options.json:
        print(json.dumps({"sets": rows}))
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
