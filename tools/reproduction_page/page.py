# SPDX-License-Identifier: Apache-2.0
"""reproduction.html: one self-contained page on what tools/reproduce found."""

import base64
from html import escape

from run_report.page import STYLE as LOOK
from run_report.run import count

from . import figures
from .differences import of_command, of_rates, of_square, of_variation
from .results import LINES, PAPER, ROBOTS, change_at, curves, name, our_rate, pick

STYLE = LOOK + """
th{text-align:right;color:#555;font-weight:normal;border-bottom:1px solid #ccc;padding:.2rem .6rem;vertical-align:bottom;white-space:nowrap}
td{text-align:right;padding:.15rem .6rem} td:first-child,th:first-child{text-align:left;padding-left:0;white-space:nowrap}
td.papers,th.papers{background:#F4F4F4;color:#1a1a1a} td.over{color:#D55E00} tr.real td{border-top:1px solid #bbb}
figure{margin:1rem 0} p,li{max-width:50rem} li{margin:.3rem 0} code{font-size:.9em}
.wide{overflow-x:auto} .wide td,.wide th{padding-left:.35rem;padding-right:.45rem} th.first,td.first{border-left:1px solid #ccc} th.group{text-align:center} h3{margin:1.6rem 0 .4rem}
"""


def percent(value):
    return f"{value:.2f}" if value < 99.95 else count(round(value))


def cell(text, css=""):
    return f'<td class="{css}">{escape(text)}</td>' if css else f"<td>{escape(text)}</td>"


def picture(path, caption):
    data = base64.b64encode(path.read_bytes()).decode()
    return (f'<figure><img alt="{escape(path.stem)}" src="data:image/png;base64,{data}">'
            f"<figcaption>{caption}</figcaption></figure>")


def items(texts):
    return f"<h3>What differs, and why</h3><ul>{''.join(f'<li>{text}</li>' for text in texts)}</ul>"


def columns(results, line):
    """(robot, curve) of the table of a line."""
    for robot, found in results["virtual_time"].items():
        for curve, _, _ in figures.shown_loops(curves(found["variation"], line)):
            yield robot, curve


def variation_table(results, line):
    shown = list(columns(results, line))
    each = len(shown) // len(results["virtual_time"])
    first = ["first" if k % each == 0 else "" for k in range(len(shown))]
    head = "".join(f'<th class="group first" colspan="{each}">{escape(ROBOTS[robot])}</th>'
                   for robot in results["virtual_time"])
    below = "".join(f'<th class="{css}">{escape(name(curve)).replace(", ", "<br>")}<br>{curve["tangent"]}</th>'
                    for css, (_, curve) in zip(first, shown))
    rows = ""
    for speed, papers in zip(PAPER["line_speed_mm_s"], PAPER["largest_change_percent"]):
        changes = [change_at(curve, speed) for _, curve in shown]
        rows += f"<tr><td>{speed:g}</td>" + cell(f"{papers:g}", "papers") + "".join(
            cell(percent(change), css + " over" * (change > PAPER["limit_percent"]))
            for css, change in zip(first, changes)) + "</tr>"
    fastest = max(shown[0][1]["speed_mm_s"])
    last = "".join(cell("none" if c["speed_at_limit_mm_s"] is None else f"{c['speed_at_limit_mm_s']:.0f}", css)
                   for css, (_, c) in zip(first, shown))
    return (f'<h3>{LINES[line]}</h3><div class="wide"><table><tr><th></th><th></th>{head}</tr>'
            f'<tr><th>speed,<br>mm/s</th><th class="papers">the paper,<br>%</th>{below}</tr>{rows}'
            f'<tr><td>10 % at</td>{cell(str(PAPER["speed_at_limit_mm_s"]), "papers")}{last}</tr></table>'
            f"</div><p>The last row is the speed at which 10 % are passed, mm/s. “None”: not at any speed tried, up to {fastest:g} mm/s at 15 Hz and "
            f"{max(shown[-1][1]['speed_mm_s']):g} mm/s at {shown[-1][1]['model_rate_hz']:g} Hz.</p>")


def square_rows(square):
    for run in square["runs"]:
        tangent = "" if run["tangent"] == "exact" else f", {run['tangent']} tangent"
        papers = ""
        if (run["model_rate_hz"], run["tangent"]) == (PAPER["model_rate_hz"], "exact"):
            if run["loops"] == 1 and run["jitter"]:
                papers = f"{PAPER['mean_error_one_loop_mm']}"
            elif run["loops"] == 2 and not run["jitter"]:
                papers = f"{PAPER['mean_error_two_loops_mm']}"
        error = run["error_mm"]
        yield (f"<tr><td>{escape(name(run) + tangent)}</td>{cell(papers, 'papers')}"
               f"{cell('{mean:.2f} / {p95:.2f} / {max:.2f}'.format(**error))}"
               f"{cell(count(round(run['roughness_mm_s2'])))}</tr>")


def real_rows(real_time):
    for run in (real_time or {"runs": []})["runs"]:
        error = run["error_mm"] or {"mean": float("nan"), "p95": float("nan"), "max": float("nan")}
        yield (f'<tr class="real"><td>two loops, {run["model_rate_hz"]:.0f} Hz, in real time</td>{cell("", "papers")}'
               f"{cell('{mean:.2f} / {p95:.2f} / {max:.2f}'.format(**error))}"
               f"{cell(count(round(run['roughness_mm_s2'])))}</tr>")


def square_table(results):
    tables = ""
    for robot, found in results["virtual_time"].items():
        square = found["square"]
        rows = "".join(square_rows(square))
        if robot == "diamond":
            rows += "".join(real_rows(results["real_time"]))
        tables += (f"<h3>{escape(ROBOTS[robot])}: {square['rounds']:g} rounds at {square['speed_mm_s']:g} mm/s</h3>"
                   '<div class="wide"><table><tr><th>loops</th><th class="papers">the paper\'s robot,<br>mean error, mm'
                   "</th><th>error: mean / 95 % / largest,<br>mm</th><th>roughness of the commands,<br>mm/s²</th></tr>"
                   f"{rows}</table></div>")
    return tables


def rates_table(results):
    real_time = results["real_time"]
    if not real_time:
        return "<p>The runs in real time were left out (<code>--no-real-time</code>).</p>"
    rows = ""
    for what, papers, value in (
            ("model loop, reached", "15 Hz", lambda run: f"{run['model_rate_hz']:.0f} Hz"),
            ("control loop", "around 600 Hz", lambda run: f"{run['control_rate_hz']:g} Hz"),
            ("cycles, late", "–", lambda run: f"{count(run['cycles'])}, {count(run['late_cycles'])}"),
            ("wake-up after the deadline, median / 99.9 % / worst", "–",
             lambda run: "{} / {} / {} µs".format(*(round(run["wakeup_us"][key]) for key in ("p50", "p99.9", "max")))),
            ("work in a cycle (bus, QP, bus), median / worst", "“a few ms”",
             lambda run: "{} / {} µs".format(*(round(run["cycle_us"][key]) for key in ("p50", "max")))),
            ("scheduling", "–", lambda run: run["scheduling"]),
            ("bus", "–", lambda run: "a local socket" if "local" in run["bus"] else run["bus"]),
            ("faults", "–", lambda run: "; ".join(run["faults"] + run["warnings"]) or "none")):
        rows += f"<tr><td>{what}</td>{cell(papers, 'papers')}{''.join(cell(value(r)) for r in real_time['runs'])}</tr>"
    return ('<table><tr><th></th><th class="papers">the paper</th><th>model throttled to 15 Hz</th>'
            f"<th>model as fast as it can</th></tr>{rows}</table>")


def at_limit(results, robot, line, *loops):
    speed = pick(curves(results["virtual_time"][robot]["variation"], line), *loops)["speed_at_limit_mm_s"]
    return "no speed tried" if speed is None else f"{speed:.0f} mm/s"


def sentence(results):
    """What of the paper comes out again, for a person."""
    virtual = results["virtual_time"]
    robot = list(virtual)[-1]  # the paper's, where it is there
    curve = pick(curves(virtual[robot]["variation"], "upwards"), 1, 15, "semidefinite")
    speeds = PAPER["line_speed_mm_s"][:3]
    runs = virtual["diamond"]["square"]["runs"]
    one, two = pick(runs, 1, 15, jitter=runs[1]["jitter"]), pick(runs, 2, 15)
    return (f"Mean error on the square with the model at 15 Hz: {one['error_mm']['mean']:.2f} mm with one loop, "
            f"{two['error_mm']['mean']:.2f} mm with two (the paper's robot: {PAPER['mean_error_one_loop_mm']} and "
            f"{PAPER['mean_error_two_loops_mm']} mm), with commands {one['roughness_mm_s2'] / two['roughness_mm_s2']:.0f} "
            "times as smooth. Largest change of the QP's matrix in a step, one loop, upwards, SOFA's tangent, "
            f"{ROBOTS[robot]}, at {' / '.join(f'{speed:g}' for speed in speeds)} mm/s: "
            f"{' / '.join(f'{change_at(curve, speed):.1f}' for speed in speeds)} % (the paper: "
            f"{' / '.join(f'{change:g}' for change in PAPER['largest_change_percent'][:3])} %).")


def tiles(results):
    """The figures a reader asks for first: (value, what it is)."""
    virtual = results["virtual_time"]
    runs = virtual["diamond"]["square"]["runs"]
    one, two = pick(runs, 1, 15, jitter=runs[1]["jitter"]), pick(runs, 2, 15)
    robot = "paper_diamond" if "paper_diamond" in virtual else "diamond"
    yield (f"{one['error_mm']['mean']:.2f} → {two['error_mm']['mean']:.2f} mm",
           f"mean error, one loop → two, model at 15 Hz (the paper: {PAPER['mean_error_one_loop_mm']} → "
           f"{PAPER['mean_error_two_loops_mm']} mm)")
    yield (f"{one['roughness_mm_s2'] / two['roughness_mm_s2']:.0f} ×", "smoother commands with two loops")
    yield (at_limit(results, robot, "upwards", 1, 15, "semidefinite"),
           f"the QP's matrix changes by 10 % in a step, upwards, {ROBOTS[robot]}, 15 Hz, SOFA's tangent (the "
           f"paper: {PAPER['speed_at_limit_mm_s']} mm/s)")
    for run in (results["real_time"] or {"runs": []})["runs"][-1:]:
        yield (f"{run['control_rate_hz']:g} and {run['model_rate_hz']:.0f} Hz",
               "control and model loop in real time here (the paper: 600 and 15 Hz)")


def robot_facts(results):
    rows = ""
    for robot, found in results["virtual_time"].items():
        facts = found["square"]
        rest = ", ".join(f"{round(x, 1) + 0:g}" for x in facts["tip_at_rest_mm"])
        rows += (f"<tr><td>{escape(ROBOTS[robot])}</td>{cell(count(facts['nodes']))}{cell(count(facts['tetrahedra']))}"
                 f"{cell(rest)}</tr>")
    return ("<table><tr><th>robot</th><th>nodes</th><th>tetrahedra</th><th>tip at rest, mm</th></tr>"
            f"{rows}<tr><td>the paper</td>{cell(count(PAPER['nodes']), 'papers')}"
            f"{cell(count(PAPER['elements']), 'papers')}{cell('–', 'papers')}</tr></table>")


def body(results, drawn):
    """The page's sections, in HTML."""
    fast = our_rate(results["virtual_time"]["diamond"]["square"]["runs"])
    jitter = 100 * results["virtual_time"]["diamond"]["square"]["runs"][1]["jitter"]
    yield f"""<p>F. Largilliere, V. Verona, E. Coevoet, M. Sanz-Lopez, J. Dequidt, C. Duriez: “Real-time Control of
Soft-Robots using Asynchronous Finite Element Modeling”, ICRA 2015, section IV, repeated with Tendril. All figures but
those marked “in real time” are from virtual time: control loop, model, bus, drives and a dynamic body, each called at
its instants by one clock, so that every run gives the same figures. (The model's kernels for processors with AVX-512 and
without round differently in the last bit: between such machines figures may differ a little, and those of a model that
runs away widely.)</p>
{robot_facts(results)}
<p><b>One loop</b> is the paper's generic method: the target is read when a step of the model begins, K, W and the QP
follow, and the command goes out when the step ends and stands still until the next one ends; the model moves under the
efforts of that QP. <b>Two loops</b> are the paper's asynchronous method and Tendril's: the model publishes a snapshot
at the end of each period and moves under the newest efforts, while the control loop solves the QP at 600 Hz for the newest
target. The model runs at 15 Hz, the paper's rate, or at {fast:g} Hz, about what Tendril reaches with this mesh on a core
of a present machine (<code>tendrild --check</code> tells); ± {jitter:.0f} % marks periods that vary.</p>
<h2>1. How far the QP's matrix changes from one snapshot to the next</h2>
<p>The largest change of ‖W<sub>ea</sub>ᵀW<sub>ea</sub>‖<sub>∞</sub> (eq. 7) from one published snapshot to the next, relative
to the one before, while the tip goes along a line. W<sub>ea</sub> is the snapshot's: that of the pose which one Newton step
under the newest efforts has led to. Red: above the 10 % that the paper accepts.</p>"""
    yield picture(drawn["variation"], "The largest change along a line over the speed of the tip. Both axes are logarithmic.")
    for line in LINES:
        yield variation_table(results, line)
    yield picture(drawn["limit_speed"], "The speed at which 10 % are passed, over the rate of the model, with one loop: "
                  "the way of the tip in one step counts, so that a model that is twice as fast bears twice the speed.")
    yield items(of_variation(results))
    yield "<h2>2. The square</h2>"
    yield picture(drawn["path"], "Figures 4 and 5 of the paper. Above: paths of the tip (lines) and the square (dashes), "
                  "seen from above. Below: distance of the tip from where it should be at that instant.")
    yield square_table(results)
    yield picture(drawn["error_map"], "Mean error on one round of the square of the diamond, by speed and model rate, mm.")
    yield items(of_square(results))
    yield "<h2>3. The command to one actuator</h2>"
    yield picture(drawn["command"], "Figure 6 of the paper: what one cable is asked for; the figures are the roughness over "
                  "all cables. The two curves of two loops lie on each other.")
    yield items(of_command())
    yield f"<h2>4. Rates</h2>{rates_table(results)}{items(of_rates())}"
    yield (f"<h2>Again</h2><p><code>tools/reproduce</code> makes this page; <code>reproduce.json</code> beside it holds "
           f"every figure. The part <code>virtual_time</code> of it has the SHA-256 <code>"
           f"{results['virtual_time_sha256'][:16]}…</code>: compare it with that of a run of your own. One experiment: "
           "<code>build/release/tools/reproduction square config/diamond.yaml</code>.</p>")


def write(folder, results):
    """Writes folder/reproduction.html with the pictures inside it, and each picture; returns the page's path."""
    drawn = figures.draw(folder, results["virtual_time"])
    boxes = "".join(f'<div class="tile"><b>{escape(value)}</b><span>{escape(what)}</span></div>'
                    for value, what in tiles(results))
    page = folder / "reproduction.html"
    page.write_text(
        '<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>Tendril: the paper, reproduced</title><style>{STYLE}</style><h1>The paper, reproduced</h1>"
        f'<div class="verdict">{escape(sentence(results))}</div><div class="tiles">{boxes}</div>'
        f'{"".join(body(results, drawn))}</html>\n', encoding="utf-8")
    return page
