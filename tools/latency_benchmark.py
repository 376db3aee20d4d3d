"""Holds tendril-latency against cyclictest, in turns; called by tools/bench.

Both report whole microseconds here, and both count a stall for every period that it covers: cyclictest leaves out the
deadlines it slept through, so they are added to its histogram by the rule of rt::Histogram::record_with_missed.
"""

import argparse
import json
import math
import re
import subprocess
import sys
from collections import Counter

HIGHEST_US = 200_000  # of cyclictest's histogram; a latency beyond it counts as the round's maximum
SHARE = 0.999


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


def tendril_latency(arguments, *what):
    place = ["--cpu", arguments.cpu] if arguments.cpu is not None else []
    place += ["--others-cpu", arguments.others_cpu] if arguments.others_cpu is not None else []
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


def main():
    parser = argparse.ArgumentParser(prog="bench latency")
    parser.add_argument("--program", required=True)
    parser.add_argument("--robot", required=True)
    parser.add_argument("--rate", type=float, default=1000)
    parser.add_argument("--priority", type=int, default=80)
    parser.add_argument("--cpu", type=int)
    parser.add_argument("--others-cpu", type=int)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()

    anchor, timer, wakeup, whole = Counter(), Counter(), Counter(), Counter()
    late = cycles = 0
    for turn in range(arguments.rounds):
        print(f"round {turn + 1} of {arguments.rounds}, {3 * arguments.seconds:g} s", file=sys.stderr, flush=True)
        anchor += cyclictest(arguments)
        timer += tendril_latency(arguments, "--timer")[1]["wakeup"]
        found, stages = tendril_latency(arguments, arguments.robot)
        wakeup += stages["wakeup"]
        whole += stages["whole"]
        late += found["late"]
        cycles += found["cycles"]

    print(f"{'us':<34}{'50 %':>8}{'99 %':>8}{'99.9 %':>8}{'max':>8}{'deadlines':>11}")
    for name, latencies in (("cyclictest", anchor), ("tendril-latency --timer, wake-up", timer),
                            ("control loop, wake-up", wakeup), ("control loop, whole cycle", whole)):
        print(f"{name:<34}{rank(latencies, 0.5):>8}{rank(latencies, 0.99):>8}{rank(latencies, SHARE):>8}"
              f"{max(latencies):>8}{latencies.total():>11}")
    result = {
        "wakeup_p999_us": rank(timer, SHARE), "cyclictest_p999_us": rank(anchor, SHARE),
        "ratio": rank(timer, SHARE) / max(1, rank(anchor, SHARE)),
        "cycle_beyond_wakeup_p999_us": rank(whole, SHARE) - rank(wakeup, SHARE), "late": late, "cycles": cycles}
    print(f"99.9 %: timer / cyclictest {result['ratio']:.2f}; the whole cycle {result['cycle_beyond_wakeup_p999_us']} us "
          f"beyond its wake-up; {late} of {cycles} cycles late")
    if arguments.json:
        print(json.dumps(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
