# SPDX-License-Identifier: Apache-2.0
"""What tendril-latency measured, as a picture and as a page that can be passed on."""

import base64
import json
from html import escape

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from .page import STYLE, table
from .run import ReportError, count, number

FILE = "latency.json"
COLOURS = {"wakeup": "#0072B2", "read": "#56B4E9", "solve": "#009E73", "write": "#CC79A7", "whole": "#000000"}
WORDS = {"wakeup": "from the intended to the actual wake-up", "read": "taking in what the bus has brought",
         "solve": "snapshot, target, QP", "write": "frames to the bus, feedback, trace",
         "whole": "from the intended wake-up to the end of the work"}
MORE_CELLS = "\ntd:not(:first-child),th{padding-left:1.5rem;text-align:right;border-bottom:1px solid #eee}\n"


def read(folder):
    path = folder / FILE
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ReportError(f"{path}: {error}") from None


def draw(folder, result):
    """How many were worse than a latency, for every latency: the tail shows on both logarithmic axes."""
    figure, axes = plt.subplots(figsize=(10, 5), layout="constrained")
    for name, figures in result["stages"].items():
        total = sum(n for _, _, n in figures["buckets"])
        worse, x, y = total, [], []
        for _, high_ns, n in figures["buckets"]:
            x.append(max(high_ns, 1) / 1000)
            y.append(worse / total)
            worse -= n
        axes.plot(x, y, color=COLOURS[name], label=name, drawstyle="steps-pre",
                  linewidth=2 if name in ("wakeup", "whole") else 1)
    axes.axvline(1e6 / result["rate_hz"], color="#D55E00", linestyle=":", label="period")
    axes.set(xscale="log", yscale="log", xlabel="latency, µs", ylabel="share of cycles that took so long or longer")
    axes.grid(True, color="#E6E6E6", linewidth=0.7)
    axes.legend(frameon=False)
    for suffix in ("svg", "png"):
        figure.savefig(folder / f"latency.{suffix}", dpi=110)
    plt.close(figure)
    return folder / "latency.png"


def stages_table(result):
    keys = ["min_us", "p50_us", "p99_us", "p99.9_us", "p99.99_us", "max_us"]
    heads = "".join(f"<th>{escape(head)}</th>" for head in
                    ("", "min", "median", "99 %", "99.9 %", "99.99 %", "max", "what it is"))
    rows = "".join(f"<tr><td>{name}</td>" + "".join(f"<td>{figures[key]:.1f}</td>" for key in keys)
                   + f"<td>{WORDS[name]}</td></tr>" for name, figures in result["stages"].items())
    return f"<h2>Latencies, µs</h2><table><tr>{heads}</tr>{rows}</table>"


def facts(result):
    yes = {True: "yes", False: "no"}
    machine = [(key.replace("_", " "), yes.get(value, "not told") if isinstance(value, (bool, type(None))) else value)
               for key, value in result["machine"].items()]
    run = [("What ran", "the bare timer" if result["what"] == "timer" else result["what"]),
           ("Rate", number(result["rate_hz"], "Hz")), ("Duration", number(result["seconds"], "s")),
           ("Scheduling", result["scheduling"]), ("Memory locked", yes[result["memory_locked"]]),
           ("CPUs are kept from deep sleep", yes[result["idle_latency_held"]]),
           *((f"CPU of the {who}", "any" if result[key] is None else result[key]) for who, key in
             (("measured thread", "cpu"), ("model", "model_cpu"), ("rest of ours", "housekeeping_cpu"),
              ("load", "load_cpu"))),
           *((f"{what} of the measured thread", "not counted" if result[key] is None else count(result[key]))
             for what, key in (("Heap calls", "heap_calls"), ("Page faults", "page_faults"))),
           ("Model refreshes", number(result["model_rate_hz"], "Hz")),
           ("Load beside it", ", ".join(result["load"]) or "none of ours"),
           ("Cycles missing from the figures", count(result["trace_dropped"]))]
    return run, machine


def verdict(result):
    """(whether all is well, what happened in a sentence or two)."""
    said = [f"{count(result['late'])} of {count(result['cycles'])} cycles were late."]
    said += [f"{problem[0].upper()}{problem[1:]}." for problem in result["problems"]]
    said += [f"{limit['stage']}: {limit['percent']:g} % within {number(limit['found_us'], 'µs')}, "
             f"{number(limit['limit_us'], 'µs')} allowed{'' if limit['met'] else ': broken'}."
             for limit in result["limits"]]
    return not result["problems"] and all(limit["met"] for limit in result["limits"]), " ".join(said)


def write(folder):
    """Draws folder/latency.json; returns the path of the page."""
    result = read(folder)
    picture = base64.b64encode(draw(folder, result).read_bytes()).decode()
    well, said = verdict(result)
    both = "".join(table(title, rows) for title, rows in zip(("The run", "The machine"), facts(result)))
    page = folder / "report.html"
    page.write_text(
        f'<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>Tendril: latencies</title><style>{STYLE}{MORE_CELLS}</style><h1>Latencies of the control loop</h1>"
        f'<div class="verdict{"" if well else " fault"}">{escape(said)}</div>{stages_table(result)}'
        f'<h2>How often it took longer</h2><figure><img alt="latencies" src="data:image/png;base64,{picture}">'
        f"<figcaption>Latencies count from the intended wake-up; a stall counts for every period that it covers."
        f'</figcaption></figure><div class="tables">{both}</div></html>\n', encoding="utf-8")
    return page
