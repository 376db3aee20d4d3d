# SPDX-License-Identifier: Apache-2.0
"""Draws the pictures of a case, in the look of tools/report."""

import io

from run_report.pictures import ACTUATORS as COLOURS, GREY, plt
from matplotlib.ticker import FuncFormatter, NullFormatter

STYLES = {"line": {"ls": "-"}, "marks": {"ls": "", "marker": "o"}, "both": {"ls": "-", "marker": "o"},
          "guide": {"ls": "--", "lw": 0.9, "color": GREY}}


def draw(picture):
    """The picture as the bytes of a PNG. Marks are open and grow from series to series, so that those in the same place
    stay visible; a series without a label looks like the one before it."""
    figure, axes = plt.subplots(figsize=(6.4, 4.8))
    named = -1
    for series in picture.series:
        named += bool(series["label"])
        style = {"color": COLOURS[named % len(COLOURS)], "ms": 4 + 2 * (named % 4), "mfc": "none",
                 **STYLES[series["style"]]}
        axes.plot(series["x"], series["y"], label=series["label"] or None, **style)
    axes.set_title(picture.title)
    axes.set_xlabel(picture.x)
    axes.set_ylabel(picture.y)
    if picture.logarithmic:
        axes.set_xscale("log")
        axes.set_yscale("log")
        for axis in (axes.xaxis, axes.yaxis):
            low, high = axis.get_view_interval()
            if high < 100 * low:  # too few powers of ten to read the axis by
                axis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:g}" if f"{value:e}"[0] in "125" else ""))
            else:
                axis.set_minor_formatter(NullFormatter())
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    longest = max((len(series["label"]) for series in picture.series), default=0)
    if longest:
        axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncol=2 if longest < 36 else 1)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    plt.close(figure)
    return buffer.getvalue()
