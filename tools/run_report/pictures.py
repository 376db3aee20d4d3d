# SPDX-License-Identifier: Apache-2.0
"""The pictures of a run. Colours are those of Okabe and Ito (2008), which colour-blind readers tell apart."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter

from .run import METRES, VOLUMES, deadline_latencies, number

DESIRED, MODEL, MEASURED, ALARM, GREY = "#000000", "#0072B2", "#E69F00", "#D55E00", "#7A7A7A"
ACTUATORS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#000000")
MOST_POINTS = 20000  # in one line; more only makes the file larger

plt.rcParams.update({
    "figure.dpi": 110, "font.size": 10, "axes.titlesize": 11, "axes.titleweight": "bold", "axes.titlelocation": "left",
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": "#E6E6E6",
    "grid.linewidth": 0.7, "axes.axisbelow": True, "legend.frameon": False, "lines.linewidth": 1.4,
    "figure.constrained_layout.use": True})


def colours_of(actuators):
    """A colour for each of so many actuators, the same one in every picture."""
    if actuators <= len(ACTUATORS):
        return ACTUATORS[:actuators]
    return plt.get_cmap("viridis")(np.linspace(0, 0.95, actuators))


def thinned(*columns):
    """Every n-th row of all columns, with the smallest n that leaves few enough to draw."""
    step = max(1, -(-len(columns[0]) // MOST_POINTS))
    return [c[::step] for c in columns]


def no_data(axes, text):
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=GREY)


def shade_phases(axes, trace, names):
    """Greys what is not the run itself; names the phases above the axes where they are long enough to carry a name."""
    phases = trace.phases()
    whole = phases[-1][2] - phases[0][1]
    axes.set_xlim(phases[0][1], phases[-1][2])
    for name, start, end in phases:
        if name != "run":
            axes.axvspan(start, end, color="#F1F1F1", lw=0)
        if names and end - start > 0.04 * whole:
            axes.text((start + end) / 2, 1.01, name, transform=axes.get_xaxis_transform(), ha="center", va="bottom",
                      fontsize=8, color=GREY)


def distance(a, b):
    """Between positions, row by row, in the coordinates that both have; NaN in rows where they share none."""
    apart = a - b
    return np.where(np.isfinite(apart).any(axis=1), np.sqrt(np.nansum(apart ** 2, axis=1)), np.nan)


def column_of_panels(panels, height):
    figure, axes = plt.subplots(panels, 1, sharex=True, figsize=(10, height), squeeze=False)
    axes[-1, 0].set_xlabel("time, s")
    return figure, axes[:, 0]


def path(trace):
    """Where the tip went: desired, model and measured; and how far off the measured tip was, and where."""
    run = trace.is_running()
    target, model = trace.position("target")[run], trace.position("model")[run]
    when, measured, wanted, _ = trace.sightings()
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5), sharex=True, sharey=True)
    if not run.any() or not trace.axes:
        for axes in (left, right):
            no_data(axes, "the run ended before the tip followed its path")
        return figure
    plane = len(trace.axes) > 1
    across = (lambda t, p: p[:, 0]) if plane else (lambda t, p: t)
    up = (lambda p: p[:, 1]) if plane else (lambda p: p[:, 0])
    t = trace["t_s"][run]
    if len(when):
        left.plot(*thinned(across(when, measured), up(measured)), ".", color=MEASURED, ms=3, label="measured")
    left.plot(*thinned(across(t, model), up(model)), color=MODEL, lw=3, label="model")
    left.plot(*thinned(across(t, target), up(target)), color=DESIRED, lw=1, label="desired")
    left.set_title("Path of the tip" + (" seen from above" if trace.axes[:2] == ["x", "y"] else ""))
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncol=3, markerscale=3)

    who = "measured tip" if len(when) else "model's tip"
    when, tip, wanted = (when, measured, wanted) if len(when) else (t, model, target)
    right.set_title(f"Distance of the {who} from the desired one")
    x, y, far = thinned(across(when, tip), up(tip), distance(tip, wanted))
    dots = right.scatter(x, y, c=far, s=6, cmap="cividis", vmin=0)
    figure.colorbar(dots, ax=right, label="mm", shrink=0.85)
    right.plot(*thinned(across(t, target), up(target)), color=DESIRED, lw=0.7)
    for axes in (left, right):
        axes.set_xlabel(f"{trace.axes[0]}, mm" if plane else "time, s")
        axes.set_ylabel(f"{trace.axes[1 if plane else 0]}, mm")
        if plane:
            axes.set_aspect("equal", adjustable="box")
    return figure


def error(trace):
    """The tip's error over time: its length, then each controlled coordinate of it."""
    figure, axes = column_of_panels(1 + len(trace.axes), 3.2 + 1.7 * len(trace.axes))
    when, measured, wanted, model = trace.sightings()
    run = trace.is_running()
    shade_phases(axes[0], trace, names=True)
    if len(when):
        length = distance(measured, wanted)
        axes[0].plot(*thinned(when, distance(measured, model)), color=MODEL, lw=1,
                     label="measured to model")
        axes[0].plot(*thinned(when, length), color=MEASURED, label="measured to desired")
        axes[0].axhline(np.nanmean(length), color=DESIRED, lw=1, ls="--", label=f"mean {np.nanmean(length):.2f} mm")
        offset, who = measured - wanted, "measured"
    elif run.any() and trace.axes:
        when, offset, who = trace["t_s"][run], (trace.position("model") - trace.position("target"))[run], "model"
        axes[0].plot(*thinned(when, np.linalg.norm(offset, axis=1)), color=MODEL,
                     label="model to desired (the tip was not measured)")
    else:
        no_data(axes[0], "the run ended before the tip followed its path")
        return figure
    axes[0].set_title("Error of the tip", pad=16)
    axes[0].set_ylabel("distance, mm")
    axes[0].set_ylim(0, 1.3 * axes[0].get_ylim()[1])  # room for the legend above the curves
    axes[0].legend(loc="upper right", ncol=3)
    largest = 1.1 * np.nanmax(np.abs(offset), initial=1e-3)
    for i, axis in enumerate(trace.axes):
        axes[1 + i].set_ylim(-largest, largest)
        shade_phases(axes[1 + i], trace, names=False)
        axes[1 + i].axhline(0, color=DESIRED, lw=0.8)
        axes[1 + i].plot(*thinned(when, offset[:, i]), color=MEASURED if who == "measured" else MODEL, lw=1)
        axes[1 + i].set_ylabel(f"{axis}: {who}\n− desired, mm")
    return figure


def commands(trace):
    """What was asked of every actuator, what its drive measured, and its effort, the model's and a sensor's; three
    panels for those in metres and newtons, three for cavities."""
    names = list(trace.actuators)
    kinds = [units for units in (METRES, VOLUMES) if units in trace.actuators.values()]
    few = len(names) <= len(ACTUATORS)
    colours = colours_of(len(names))
    rows_of_legend = -(-len(names) // 8)
    figure, axes = column_of_panels(3 * len(kinds), 8 * len(kinds) + 0.25 * rows_of_legend)
    t = trace["t_s"]
    width = 1.4 if few else 0.8
    titles = ("Commands (lines) and what the drives measured (dots)", "Measured minus commanded",
              "Efforts in the QP (lines) and what sensors measured (dots)")
    for row, units in enumerate(kinds):
        panels = axes[3 * row:3 * row + 3]
        for name, colour in zip(names, colours):
            if trace.actuators[name] != units:
                continue
            command, measured, effort = trace.actuator(name)
            panels[0].plot(*thinned(t, command), color=colour, lw=width, label=name)
            panels[0].plot(*thinned(t, measured), color=colour, lw=width, ls=":")
            panels[1].plot(*thinned(t, measured - command), color=colour, lw=width / 2)
            panels[2].plot(*thinned(t, effort), color=colour, lw=width)
            panels[2].plot(*thinned(*trace.measured_effort(name)), ".", color=colour, ms=2)
        labels = (units.displacement_name, units.displacement_name.split(", ")[1], units.effort_name)
        for panel, title, label in zip(panels, titles, labels):
            first = panel is axes[0]
            shade_phases(panel, trace, names=first)
            panel.set_title(title, pad=16 if first else 6)
            panel.set_ylabel(label)
    legend = [panel.get_legend_handles_labels() for panel in axes[::3]]
    axes[-1].legend(sum((handles for handles, _ in legend), []), sum((labels for _, labels in legend), []),
                    loc="upper center", bbox_to_anchor=(0.5, -0.22), ncol=8)
    return figure


def histogram(axes, values, figures, title, unit):
    """Counts on a log scale, so that the one late cycle among many shows; marks what summary.json tells as median, 99.9 %
    and worst."""
    values = values[np.isfinite(values)]
    axes.set_title(title)
    axes.set_xlabel(unit)
    axes.set_ylabel("cycles")
    if not len(values):
        return no_data(axes, "nothing recorded")
    lowest = max(values[values > 0].min(initial=np.inf), values.max() / 1e5, 1e-9)
    if not np.isfinite(lowest) or values.max() <= 0:
        return no_data(axes, f"all {len(values)} cycles: 0 {unit}")
    edges = np.geomspace(lowest * 0.95, values.max() * 1.05, 70)
    axes.hist(np.clip(values, lowest, None), bins=edges, color=MODEL, log=True)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(0.7, axes.get_ylim()[1] * 3)
    marks = ((figures["p50"], "median", GREY), (figures["p99.9"], "99.9 %", DESIRED), (figures["max"], "worst", ALARM))
    for value, name, colour in marks:
        axes.axvline(value, color=colour, lw=1.2, label=f"{name} {number(value, unit)}")
    axes.legend(loc="upper right", frameon=True, framealpha=0.9, edgecolor="none")


def envelope(axes, t, values):
    """Smallest to largest value in each of at most 300 stretches of time: a line of every cycle would be a block."""
    stretches = [s for s in np.array_split(np.arange(len(t)), min(300, len(t))) if np.isfinite(values[s]).any()]
    when = [t[s[0]] for s in stretches]
    lowest, highest = ([f(values[s]) for s in stretches] for f in (np.nanmin, np.nanmax))
    axes.fill_between(when, lowest, highest, color=MODEL, alpha=0.25, lw=0)
    axes.plot(when, highest, color=MODEL, label="oldest used")
    axes.legend(loc="upper right", frameon=True, framealpha=0.9, edgecolor="none")


def timing(trace, summary):
    """How punctual the control thread was, how long a cycle took, how old the model was, how hard the QP worked."""
    figure, axes = plt.subplots(2, 2, figsize=(11, 7), layout="none",  # to find margins takes as long as to draw
                                gridspec_kw={"left": 0.06, "right": 0.985, "top": 0.955, "bottom": 0.065, "wspace": 0.15,
                                             "hspace": 0.27})
    period_us = 1e6 / summary["control_rate_hz"]
    wakeups = np.array(deadline_latencies(trace["wakeup_us"], trace["cycle_us"], period_us))
    histogram(axes[0, 0], wakeups, summary["wakeup_us"], "Wake-up latency at every deadline", "µs")
    histogram(axes[0, 1], trace["cycle_us"], summary["cycle_us"], f"Work in one cycle (of a period of {period_us:.0f} µs)",
              "µs")
    age = axes[1, 0]
    shade_phases(age, trace, names=False)
    envelope(age, trace["t_s"], 1e3 * trace["snapshot_age_s"])
    age.set(title="Age of the model's snapshot", xlabel="time, s", ylabel="ms", ylim=(0, 1.3 * age.get_ylim()[1]))
    steps = trace["qp_iterations"][np.isfinite(trace["qp_iterations"])]
    qp = axes[1, 1]
    qp.set(title="Iterations of the QP", xlabel="iterations", ylabel="cycles")
    if len(steps):
        qp.hist(steps, bins=np.arange(steps.min() - 0.5, steps.max() + 1.5), color=MODEL, log=True, rwidth=0.9)
        qp.xaxis.get_major_locator().set_params(integer=True)
        qp.set_ylim(0.7, 3 * len(steps))
    return figure


def draw(folder, summary, trace):
    """Writes the four pictures into the folder; returns (title, caption, path) of each in reading order."""
    figures = (
        ("path", "Path", path(trace), "Left: where the tip should have gone, where the model puts it, and where "
         "sensors saw it. Right: the measured points (the model's where none is measured), coloured by their "
         "distance from the desired point of the same instant. Only the phase “run” is drawn."),
        ("error", "Error", error(trace), "The distance of the measured tip from the desired one is the error of the "
         "whole; that from the model's tip is the model's share of it. Grey: not part of the run."),
        ("commands", "Commands", commands(trace), "What was sent to every actuator, what its drive measured, and the "
         "effort that the QP reckons with, beside the one that a sensor told. Grey: not part of the run."),
        ("timing", "Timing", timing(trace, summary), "Wake-up latency counts from the "
         "instant at which the cycle was due; a stall counts for every deadline that it covers. The scale of counts is logarithmic: a single late cycle is visible."))
    written = []
    for name, title, figure, caption in figures:
        target = Path(folder) / f"{name}.png"
        figure.savefig(target)
        plt.close(figure)
        written.append((title, caption, target))
    return written
