# SPDX-License-Identifier: Apache-2.0
"""Holds tendril-latency against cyclictest, in turns; called by tools/bench.

Both report whole microseconds here, and both count a stall for every period that it covers: cyclictest leaves out the
deadlines it slept through, so they are added to its histogram by the rule of rt::Histogram::record_with_missed.

Every percentile is that of one turn, and the median of all turns is told: a machine that stalls in some of them, as
virtual machines do, would otherwise make the figure by itself. What is compared is compared within a turn.
"""

import argparse
import json
import math
import re
import subprocess
import sys
from collections import Counter, defaultdict
from statistics import median

HIGHEST_US = 200_000  # of cyclictest's histogram; a latency beyond it counts as the round's maximum
SHARES = (0.5, 0.99, 0.999)


def fail(code, what):
    print(f"bench: {what}", file=sys.stderr)
    sys.exit(code)


def run(*command):
    words = [str(word) for word in command]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        fail(ended.returncode if ended.returncode == 3 else 1,
             f"{' '.join(words)} ended with {ended.returncode}: {ended.stderr.strip()}")
    return ended.stdout


def with_missed(latencies, period_us):
    """The latencies and those of the deadlines that were slept through, us."""
    result = Counter()
    for latency, count in latencies.items():
        result[latency] += count
        for missed in range(latency - period_us, 0, -period_us):
            result[missed] += count
    return result


def cyclictest(arguments):
    period_us = round(1e6 / arguments.rate)
    place = [f"--affinity={arguments.cpu}"] if arguments.cpu is not None else []
    out = run("cyclictest", "--mlockall", "--threads=1", f"--priority={arguments.priority}", "--quiet", *place,
              f"--interval={period_us}", f"--loops={round(arguments.seconds * arguments.rate)}",
              f"--histogram={HIGHEST_US}")
    latencies = Counter({int(us): int(count) for us, count in re.findall(r"^(\d+) (\d+)$", out, re.MULTILINE)})
    overflows = int(re.search(r"^# Histogram Overflows: (\d+)", out, re.MULTILINE)[1])
    latencies[int(re.search(r"^# Max Latencies: (\d+)", out, re.MULTILINE)[1])] += overflows
    return with_missed(+latencies, period_us)


def tendril_latency(arguments, *what, cpu=None, others_cpu=None):
    place = [] if cpu is None else ["--cpu", cpu]
    place += [] if others_cpu is None else ["--others-cpu", others_cpu, "--load-cpu", others_cpu]
    found = json.loads(run(arguments.program, *what, "--rate", arguments.rate, "--duration", arguments.seconds,
                           "--priority", arguments.priority, *place, "--json"))
    stages = {}
    for stage, figures in found["stages"].items():
        stages[stage] = Counter()
        for low_ns, _, count in figures["buckets"]:
            stages[stage][low_ns // 1000] += count
    return found, stages


def rank(latencies, share):
    """The least latency that at least this share of all do not exceed, us."""
    wanted, seen = math.ceil(share * latencies.total()), 0
    for latency in sorted(latencies):
        seen += latencies[latency]
        if seen >= wanted:
            return latency
    return 0


def percentiles(turns):
    """Of SHARES, the medians of the turns, us."""
    return [round(median(rank(latencies, share) for latencies in turns)) for share in SHARES]


def median_interval(values):
    """Where the median lies with 95 % confidence: the order statistics that a binomial distribution gives, whatever the
    values' own is. Under six values do not tell that much: they give their range."""
    values = sorted(values)
    count, below, tail = len(values), 0, 0.0
    while below < count // 2 and tail + math.comb(count, below) / 2**count <= 0.025:
        tail += math.comb(count, below) / 2**count
        below += 1
    first = max(0, below - 1)
    return values[first], values[count - 1 - first]


# What may get in the way of the control thread, from nearly nothing on.
NEIGHBOURS = {
    "model at 5 Hz": ["--model-rate", 5],
    "model as fast as it can": [],
    "... and memory unmapped": ["--load", "unmap"],
    "... and memory traffic": ["--load", "memory"],
}


def measure_isolation(arguments):
    """What the model thread and its like do to the control thread, from another CPU and on its own."""
    others = 0 if arguments.others_cpu is None else arguments.others_cpu
    own = 1 - min(others, 1) if arguments.cpu is None else arguments.cpu
    runs = [(cpu, name) for cpu in (own, others) for name in NEIGHBOURS]
    turns = {run: defaultdict(list) for run in runs}
    late, model_hz = Counter(), Counter()
    for turn in range(arguments.rounds):
        print(f"round {turn + 1} of {arguments.rounds}, {len(runs) * arguments.seconds:g} s", file=sys.stderr, flush=True)
        for cpu, name in runs:
            found, stages = tendril_latency(arguments, arguments.robot, *NEIGHBOURS[name], cpu=cpu, others_cpu=others)
            for stage, latencies in stages.items():
                turns[cpu, name][stage].append(latencies)
            late[cpu, name] += found["late"]
            model_hz[cpu, name] += found["model_rate_hz"] / arguments.rounds

    print(f"{'us':<28}{'wake-up 50 %':>13}{'99 %':>6}{'99.9 %':>8}{'whole 50 %':>12}{'99 %':>6}{'99.9 %':>8}{'late':>6}"
          f"{'cycles':>8}{'model':>9}")
    rows = []
    for cpu, name in runs:
        if name == next(iter(NEIGHBOURS)):
            print("control thread on a CPU of its own" if cpu == own else "control thread on the model's CPU")
        wakeup, whole = (percentiles(turns[cpu, name][stage]) for stage in ("wakeup", "whole"))
        cycles = sum(latencies.total() for latencies in turns[cpu, name]["whole"])
        print(f"  {name:<26}{wakeup[0]:>13}{wakeup[1]:>6}{wakeup[2]:>8}{whole[0]:>12}{whole[1]:>6}{whole[2]:>8}"
              f"{late[cpu, name]:>6}{cycles:>8}{model_hz[cpu, name]:>6.0f} Hz")
        rows.append({"own_cpu": cpu == own, "neighbour": name, "wakeup_us": wakeup, "whole_us": whole,
                     "late": late[cpu, name], "cycles": cycles, "model_hz": model_hz[cpu, name]})
    return {"percentiles": [100 * share for share in SHARES], "runs": rows}


def measure_against_cyclictest(arguments):
    turns = defaultdict(list)
    late = cycles = 0
    place = {"cpu": arguments.cpu, "others_cpu": arguments.others_cpu}
    for turn in range(arguments.rounds):
        print(f"round {turn + 1} of {arguments.rounds}, {3 * arguments.seconds:g} s", file=sys.stderr, flush=True)
        turns["cyclictest"].append(cyclictest(arguments))
        turns["tendril-latency --timer, wake-up"].append(tendril_latency(arguments, "--timer", **place)[1]["wakeup"])
        found, stages = tendril_latency(arguments, arguments.robot, **place)
        turns["control loop, wake-up"].append(stages["wakeup"])
        turns["control loop, whole cycle"].append(stages["whole"])
        late += found["late"]
        cycles += found["cycles"]

    print(f"{'us, median of the turns':<34}{'50 %':>8}{'99 %':>8}{'99.9 %':>8}{'worst':>8}{'deadlines':>11}")
    for name, of_each in turns.items():
        half, most, nearly_all = percentiles(of_each)
        print(f"{name:<34}{half:>8}{most:>8}{nearly_all:>8}{max(map(max, of_each)):>8}"
              f"{sum(latencies.total() for latencies in of_each):>11}")
    anchor, timer, wakeup, whole = ([rank(latencies, SHARES[-1]) for latencies in of_each] for of_each in turns.values())
    ratios = [ours / max(1, theirs) for ours, theirs in zip(timer, anchor)]
    beyond = [end - begin for end, begin in zip(whole, wakeup)]
    result = {
        "wakeup_p999_us": median(timer), "cyclictest_p999_us": median(anchor),
        "ratio": median(ratios), "ratio_95": median_interval(ratios),
        "cycle_beyond_wakeup_p999_us": median(beyond), "cycle_beyond_wakeup_p999_us_95": median_interval(beyond),
        "late": late, "cycles": cycles}
    (least, greatest), (soonest, latest) = result["ratio_95"], result["cycle_beyond_wakeup_p999_us_95"]
    print(f"99.9 %, turn by turn: timer / cyclictest {result['ratio']:.2f} (95 % interval of the median: {least:.2f} to "
          f"{greatest:.2f}); the whole cycle {result['cycle_beyond_wakeup_p999_us']:g} us beyond its wake-up ({soonest} "
          f"to {latest}); {late} of {cycles} cycles late")
    return result


def main():
    parser = argparse.ArgumentParser(prog="bench latency")
    parser.add_argument("--program", required=True)
    parser.add_argument("--robot", required=True)
    parser.add_argument("--rate", type=float, default=1000)
    parser.add_argument("--priority", type=int, default=80)
    parser.add_argument("--cpu", type=int)
    parser.add_argument("--others-cpu", type=int)
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=3)
    parser.add_argument("--isolation", action="store_true")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    result = measure_isolation(arguments) if arguments.isolation else measure_against_cyclictest(arguments)
    if arguments.json:
        print(json.dumps(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
