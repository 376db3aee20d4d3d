# SPDX-License-Identifier: Apache-2.0
"""validation.html: one self-contained page on what the validation cases measured."""

import base64
from html import escape

from run_report.page import STYLE as LOOK

from . import pictures
from .results import cases_of

STYLE = LOOK + """
th{text-align:left;color:#555;font-weight:normal;border-bottom:1px solid #ccc;padding:.2rem 1.5rem .2rem 0}
td{padding-right:1.5rem} td.number{text-align:right;white-space:nowrap}
.good{color:#00724F} .bad{color:#D55E00;font-weight:bold}
.pictures{display:flex;flex-wrap:wrap;gap:1rem} .pictures img{width:32rem;max-width:100%}
"""


def number(value):
    """Three significant digits; nothing for what is not a number."""
    if value is None:
        return "none"
    return f"{value:.3g}"


def limits(row):
    low, high, unit = row["at_least"], row["at_most"], row["unit"]
    if low is None and high is None:
        return ""
    if low is not None and high is not None:
        return f"{number(low)} to {number(high)} {unit}" if low != high else f"{number(low)} {unit}"
    return f"at most {number(high)} {unit}" if low is None else f"at least {number(low)} {unit}"


def table(rows):
    cells = []
    for row in rows:
        limit = limits(row)
        mark = "" if not limit else '<span class="good">yes</span>' if row["passed"] else '<span class="bad">NO</span>'
        cells.append(f'<tr><td>{escape(row["what"])}</td><td class="number">{number(row["value"])} '
                     f'{escape(row["unit"])}</td><td class="number">{escape(limit)}</td><td>{mark}</td></tr>')
    return ('<table><tr><th>figure</th><th>measured</th><th>limit</th><th>within</th></tr>'
            f'{"".join(cells)}</table>')


def section(case):
    shown = "".join(f'<figure><img alt="{escape(picture.title)}" src="data:image/png;base64,'
                    f'{base64.b64encode(pictures.draw(picture)).decode()}"></figure>' for picture in case.pictures)
    reasons = "".join(f'<p class="bad">{escape(why)}</p>' for why in case.failed)
    reasons += "".join(f"<p>Left out: {escape(why)}</p>" for why in case.skipped)
    return (f'<h2 id="{case.name}">{escape(case.title)}</h2>{reasons}<div class="pictures">{shown}</div>'
            f'{table(case.rows) if case.rows else ""}<p><code>tools/validate {case.name}</code></p>')


def write(folder, lines, short):
    """Writes folder/validation.html with the pictures inside it; returns its path."""
    cases = cases_of(lines)
    bad = [case for case in cases if not case.passed()]
    limited = sum(bool(limits(row)) for case in cases for row in case.rows)
    if bad:
        names = ", ".join(f'<a href="#{case.name}">{escape(case.title)}</a>' for case in bad)
        verdict = f"<b>Not everything is within its limits:</b> {names}"
    else:
        verdict = f"All {limited} figures of {len(cases)} cases that have limits are within them."
    if short:
        verdict += " The short form ran: coarse meshes, no CalculiX."
    page = folder / "validation.html"
    page.write_text(
        '<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>Tendril: validation of the model</title><style>{STYLE}</style>"
        f'<h1>Validation of the model</h1><div class="verdict{" fault" if bad else ""}">{verdict}</div>'
        f'{"".join(section(case) for case in cases)}</html>\n', encoding="utf-8")
    return page
