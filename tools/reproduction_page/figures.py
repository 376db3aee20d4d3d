# SPDX-License-Identifier: Apache-2.0
"""Draws the figures, in the look of tools/report."""

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.ticker import FixedLocator, NullLocator
from PIL import Image  # matplotlib's own
from run_report.pictures import ALARM, DESIRED, GREY, MEASURED, MODEL, plt

from .results import LINES, PAPER, ROBOTS, curves, name, our_rate, pick

ONE_LOOP, TWO_LOOPS, FAST = MODEL, ALARM, "#009E73"  # blue and red as in the paper
CLOSE_S = (0.9, 1.4)  # a part of the commands to look at closely
STYLE = {"exact": "-", "semidefinite": "--"}


def plain_log(axis, ticks):
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter("{x:g}")


def legend_below(figure, axes, columns, rows):
    """The legend of one of the axes, under all of them."""
    share = 0.25 * rows / figure.get_size_inches()[1]
    figure.get_layout_engine().set(rect=(0, share, 1, 1 - share))
    figure.legend(*axes.get_legend_handles_labels(), loc="lower center", ncol=columns)


def shown_loops(entries):
    """(curve, colour, label) of those in the tables."""
    fast = our_rate(entries)
    rows = ((1, 15, "semidefinite", ONE_LOOP), (1, 15, "exact", ONE_LOOP), (2, 15, "semidefinite", TWO_LOOPS),
            (2, 15, "exact", TWO_LOOPS), (2, fast, "exact", FAST))
    for loops, rate, tangent, colour in rows:
        entry = pick(entries, loops, rate, tangent)
        yield entry, colour, f"{name(entry)}, {tangent} tangent"


def variation(virtual):
    """Section IV's table as curves, one panel a line and robot."""
    robots = list(virtual)
    figure, grid = plt.subplots(len(robots), 2, figsize=(10.5, 0.9 + 3.9 * len(robots)), sharex=True, sharey=True,
                                squeeze=False)
    for row, robot in zip(grid, robots):
        for axes, line in zip(row, LINES):
            axes.plot(PAPER["line_speed_mm_s"], PAPER["largest_change_percent"], "o", color=DESIRED, ms=5,
                      label="the paper, 15 Hz, its line unknown")
            for curve, colour, label in shown_loops(curves(virtual[robot]["variation"], line)):
                axes.plot(curve["speed_mm_s"], curve["largest_change_percent"], STYLE[curve["tangent"]], color=colour,
                          label=label)
            axes.axhline(PAPER["limit_percent"], color=GREY, lw=0.9, ls=":")
            axes.set(title=f"{LINES[line]}, {ROBOTS[robot]}", xscale="log", yscale="log", xlim=(6, 160),
                     ylim=(0.01, 3e4))
            plain_log(axes.xaxis, (6.25, 12.5, 25, 50, 100, 150))
            plain_log(axes.yaxis, (0.01, 0.1, 1, 10, 100, 1000, 1e4))
        row[0].set_ylabel("largest change of ‖WᵀW‖∞, %")
    for axes in grid[-1]:
        axes.set_xlabel("speed of the tip, mm/s")
    legend_below(figure, grid[0, 0], 2, 3)
    return figure


def limit_speed(virtual):
    """The speed at which 10 % are passed against the model's rate, one panel a robot."""
    figure, row = plt.subplots(1, len(virtual), figsize=(5.4 * len(virtual), 4.6), sharex=True, sharey=True,
                               squeeze=False)
    for axes, robot in zip(row[0], virtual):
        for line, colour in zip(LINES, (MODEL, MEASURED)):
            for tangent in ("semidefinite", "exact"):
                points = [(c["model_rate_hz"], c["speed_at_limit_mm_s"])
                          for c in curves(virtual[robot]["variation"], line)
                          if c["loops"] == 1 and c["tangent"] == tangent and c["speed_at_limit_mm_s"] is not None]
                if points:
                    axes.plot(*zip(*points), STYLE[tangent] + "o", color=colour, ms=5,
                              label=f"{LINES[line].lower()}, {tangent} tangent")
        rates = np.array((7.5, 60))
        axes.plot(rates, 100 / 15 * rates, color=GREY, lw=0.9, ls=":", label="in proportion to the paper's point")
        axes.plot(15, PAPER["speed_at_limit_mm_s"], "*", color=DESIRED, ms=12, label="the paper")
        axes.set(title=ROBOTS[robot], xscale="log", yscale="log", xlabel="rate of the model, Hz")
        plain_log(axes.xaxis, (7.5, 15, 30, 60))
        plain_log(axes.yaxis, (10, 20, 50, 100, 200, 500))
    row[0, 0].set_ylabel("speed at which 10 % are passed, mm/s")
    legend_below(figure, row[0, 0], 3, 2)
    return figure


def three_runs(square):
    """What the paper's figures compare, and what Tendril makes of it: (run, colour, label)."""
    runs = square["runs"]
    for loops, rate, jitter, colour in ((1, 15, runs[1]["jitter"], ONE_LOOP), (2, 15, 0, TWO_LOOPS),
                                        (2, our_rate(runs), 0, FAST)):
        run = pick(runs, loops, rate, jitter=jitter)
        yield run, colour, name(run)


def distances(seen):
    return np.linalg.norm(np.array(seen["tip_mm"]) - np.array(seen["desired_mm"]), axis=1)


def path(square):
    """Figures 4 and 5: the paths seen from above, and the error over time."""
    figure = plt.figure(figsize=(10.5, 6.6))
    grid = figure.add_gridspec(2, 3, height_ratios=(1.5, 1))
    below = figure.add_subplot(grid[1, :])
    first = None
    for k, (run, colour, label) in enumerate(three_runs(square)):
        seen = run["series"]["seen"]
        tip, desired = np.array(seen["tip_mm"]), np.array(seen["desired_mm"])
        axes = first = figure.add_subplot(grid[0, k], sharex=first, sharey=first)
        axes.plot(tip[:, 0], tip[:, 1], color=colour)
        axes.plot(desired[:, 0], desired[:, 1], color=DESIRED, lw=0.8, ls="--")
        axes.set(title=label, xlabel="x, mm", aspect="equal")
        if k == 0:
            axes.set_ylabel("y, mm")
        error = run["error_mm"]["mean"]
        below.plot(seen["t_s"], distances(seen), color=colour, label=f"{label}: mean {error:.2f} mm")
    for mean, colour, label in ((PAPER["mean_error_one_loop_mm"], ONE_LOOP, "the paper's robot, one loop"),
                                (PAPER["mean_error_two_loops_mm"], TWO_LOOPS, "the paper's robot, two loops")):
        below.axhline(mean, color=colour, lw=0.9, ls=":", label=f"{label}: mean {mean} mm")
    below.set(title="Distance of the tip from where it should be", xlabel="time, s", ylabel="mm",
              xlim=(0, max(seen["t_s"])), ylim=(0, None))
    legend_below(figure, below, 2, 3)
    return figure


def command(square):
    """Figure 6: what one actuator is sent."""
    figure, (whole, part) = plt.subplots(1, 2, figsize=(10.5, 4.2), width_ratios=(1.3, 1))
    for run, colour, label in three_runs(square):
        sent = run["series"]["sent"]
        rough = f"{run['roughness_mm_s2']:,.0f}".replace(",", "\u202f")
        for axes in (whole, part):
            axes.plot(sent["t_s"], sent["displacement_mm"], color=colour, lw=1.2, label=f"{label}: {rough} mm/s²")
    whole.set(title=f"Command to the cable “{square['actuator']}”", ylabel="shortening, mm",
              xlim=(0, max(sent["t_s"])))
    part.set(title="half a second of it", xlim=CLOSE_S)
    t, y = np.array(sent["t_s"]), np.array(sent["displacement_mm"])
    inside = y[(t > CLOSE_S[0]) & (t < CLOSE_S[1])]
    part.set_ylim(inside.min() - 1.5, inside.max() + 0.5)
    for axes in (whole, part):
        axes.set_xlabel("time, s")
    legend_below(figure, whole, 3, 1)
    return figure


def error_map(runs):
    """Mean error over speed and model rate: one loop, two loops, and two loops with the other tangent."""
    kinds = ((1, "exact", "one loop"), (2, "exact", "two loops"), (2, "semidefinite", "two loops, semidefinite tangent"))
    rates = sorted({run["model_rate_hz"] for run in runs})
    speeds = sorted({run["speed_mm_s"] for run in runs})
    figure, row = plt.subplots(1, 3, figsize=(10.5, 3.9), sharey=True)
    for axes, (loops, tangent, title) in zip(row, kinds):
        errors = np.array([[pick(runs, loops, rate, tangent, speed_mm_s=speed)["error_mm"]["mean"] for rate in rates]
                           for speed in speeds])
        image = axes.imshow(errors, norm=LogNorm(0.3, 30), cmap="cividis", origin="lower", aspect="auto")
        for (i, k), error in np.ndenumerate(errors):
            axes.text(k, i, f"{error:.2f}" if error < 9.95 else f"{error:.1f}", ha="center", va="center", fontsize=9,
                      color="black" if error > 3 else "white")
        axes.set_xticks(range(len(rates)), [f"{rate:g}" for rate in rates])
        axes.set_yticks(range(len(speeds)), [f"{speed:g}" for speed in speeds])
        axes.set(title=title, xlabel="rate of the model, Hz")
        axes.grid(False)
    row[0].set_ylabel("speed of the tip, mm/s")
    figure.colorbar(image, ax=row, label="mean error, mm", format="{x:g}", pad=0.01)
    return figure


def draw(folder, virtual):
    """Writes all pictures into the folder; returns the path of each by name."""
    paths = {}
    square = virtual["diamond"]["square"]
    for key, figure in (("variation", variation(virtual)), ("limit_speed", limit_speed(virtual)),
                        ("path", path(square)), ("command", command(square)),
                        ("error_map", error_map(virtual["diamond"]["map"]["runs"]))):
        paths[key] = folder / f"{key}.png"
        figure.savefig(paths[key])
        plt.close(figure)
        with Image.open(paths[key]) as picture:  # 256 colours: a third of the size
            picture.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(paths[key], optimize=True)
    return paths
