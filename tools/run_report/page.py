# SPDX-License-Identifier: Apache-2.0
"""report.html: one self-contained page on a run."""

import base64
from html import escape

from .run import count, number, sentence

STYLE = """
body{font:16px/1.5 system-ui,sans-serif;max-width:72rem;margin:2rem auto;padding:0 1rem;color:#1a1a1a}
h1{font-size:1.5rem;margin:0} h2{font-size:1.15rem;margin:2.2rem 0 .4rem}
.verdict{border-left:.4rem solid #0072B2;background:#EEF5FA;padding:.8rem 1rem;margin:1rem 0;font-size:1.1rem}
.fault{border-color:#D55E00;background:#FCF0E8}
.tiles{display:flex;flex-wrap:wrap;gap:.8rem}
.tile{flex:1 1 10rem;border:1px solid #ddd;border-radius:.4rem;padding:.6rem .9rem}
.tile b{display:block;font-size:1.45rem} .tile span,figcaption{color:#555;font-size:.9rem}
figure{margin:0} img{width:100%;height:auto}
.tables{display:flex;flex-wrap:wrap;gap:2.5rem}
table{border-collapse:collapse;font-variant-numeric:tabular-nums}
td{padding:.2rem 0;border-bottom:1px solid #eee;vertical-align:top} td:first-child{color:#555;padding-right:1.5rem}
"""


def tiles(summary):
    """The four figures a reader asks for first: (value, what it is)."""
    tracking = summary["tracking_error_mm"] or {}
    return (
        (number(tracking.get("mean"), "mm"), f"mean error of the tip (95 % below {number(tracking.get('p95'), 'mm')})"),
        (f"{count(summary['late_cycles'])} late", f"of {count(summary['cycles'])} cycles at "
         f"{number(summary['control_rate_hz'], 'Hz')}"),
        (number(summary["model_rate_hz"], "Hz"), f"model refreshes: {count(summary['nodes'])} nodes, "
         f"{count(summary['tetrahedra'])} tetrahedra"),
        (f"{summary['qp'].get('iterations_max')} of {summary['qp'].get('cap')}", "iterations of the QP at most"),
    )


def tables(summary):
    """The run's figures and its settings, each a list of (what, value)."""
    tracking, model = summary["tracking_error_mm"] or {}, summary["model_error_mm"] or {}
    target = summary.get("target_to_model_mm") or {}
    qp, rt = summary["qp"], summary["rt"]
    statuses = ", ".join(f"{name} {count(n)}" for name, n in qp.get("statuses", {}).items())
    figures = [
        ("Error of the tip, mean", number(tracking.get("mean"), "mm")),
        ("Error of the tip, 95 %", number(tracking.get("p95"), "mm")),
        ("Error of the tip, largest", number(tracking.get("max"), "mm")),
        ("Error of the model, mean", number(model.get("mean"), "mm")),
        ("Error of the model, largest", number(model.get("max"), "mm")),
        ("Target to model, mean", number(target.get("mean"), "mm")),
        ("Target to model, largest", number(target.get("max"), "mm")),
        ("Control cycles", count(summary["cycles"])),
        ("Late cycles", count(summary["late_cycles"])),
        ("Model refreshes", count(summary["model_refreshes"])),
        ("QP results", statuses or "none"),
        ("Heap calls in the control thread", number(rt.get("heap_calls"))),
        ("Major page faults", number(rt.get("major_faults"))),
    ]
    figures += [(f"Effort of {name}, measured to the model's, mean", number(error["mean"], error["unit"]))
                for name, error in summary["effort_error"].items() if error]
    figures += [(f"Sensor {name}", f"lost {sensor['losses']} times, for {number(sensor['stale_s'], 's')} in all")
                for name, sensor in summary["sensors"].items()]
    settings = [
        ("Robot", summary["robot"]),
        ("Mesh", f"{count(summary['nodes'])} nodes, {count(summary['tetrahedra'])} tetrahedra"),
        ("Actuators", summary["actuators"] if isinstance(summary["actuators"], int) else len(summary["actuators"])),
        ("Controlled coordinates", summary["effector_dofs"]),
        ("Bus", summary["bus"]),
        ("Control rate", number(summary["control_rate_hz"], "Hz")),
        ("Duration", number(summary["duration_s"], "s")),
        ("Iteration cap of the QP", qp.get("cap")),
        ("Scheduling", f"{rt.get('policy')}, priority {rt.get('priority')}"),
        ("Memory locked", "yes" if rt.get("memory_locked") else "no"),
    ]
    return figures, settings


def table(title, rows):
    cells = "".join(f"<tr><td>{escape(what)}</td><td>{escape(str(value))}</td></tr>" for what, value in rows)
    return f"<div><h2>{title}</h2><table>{cells}</table></div>"


def write(folder, summary, trace, pictures):
    """Writes folder/report.html with the pictures inside it; returns its path."""
    faults, warnings = ("".join(f"<br>{escape(each)}" for each in summary[key]) for key in ("faults", "warnings"))
    verdict = f"<b>The run ended with a fault.</b>{faults}" if faults else escape(sentence(summary, trace))
    if warnings:
        verdict += f"<br><b>It got over:</b>{warnings}"
    boxes = "".join(f'<div class="tile"><b>{escape(value)}</b><span>{escape(what)}</span></div>'
                    for value, what in tiles(summary))
    shown = "".join(
        f'<h2>{title}</h2><figure><img alt="{title}" src="data:image/png;base64,'
        f'{base64.b64encode(picture.read_bytes()).decode()}"><figcaption>{escape(caption)}</figcaption></figure>'
        for title, caption, picture in pictures)
    both = "".join(table(title, rows) for title, rows in zip(("Figures", "Settings"), tables(summary)))
    page = folder / "report.html"
    page.write_text(
        f'<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>Tendril: {escape(summary['robot'])}</title><style>{STYLE}</style>"
        f"<h1>A run of the {escape(summary['robot'])}</h1>"
        f'<div class="verdict{" fault" if faults else ""}">{verdict}</div><div class="tiles">{boxes}</div>'
        f'{shown}<div class="tables">{both}</div></html>\n', encoding="utf-8")
    return page
