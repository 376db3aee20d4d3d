# SPDX-License-Identifier: Apache-2.0
"""One run of the controller as its report folder tells it: summary.json and trace.csv."""

import csv
import json
from collections import namedtuple
from pathlib import Path

import numpy as np

SUMMARY_KEYS = ("robot", "nodes", "tetrahedra", "actuators", "effector_dofs", "bus", "control_rate_hz", "duration_s",
                "cycles", "late_cycles", "model_refreshes", "model_rate_hz", "tracking_error_mm", "model_error_mm",
                "effort_error", "sensors", "qp", "rt", "wakeup_us", "cycle_us", "faults", "warnings")
TEXT_COLUMNS = ("phase", "qp_status")
AXES = ("x", "y", "z")

# An actuator's units as the columns are named, and as people read them: the scale and the name of each.
Units = namedtuple("Units", "displacement effort displacement_scale displacement_name effort_scale effort_name")
METRES = Units("m", "N", 1e3, "displacement, mm", 1, "effort, N")
VOLUMES = Units("m3", "Pa", 1e6, "growth, ml", 1e-3, "pressure, kPa")


class ReportError(Exception):
    """A folder that is no report, in a sentence for the person who named it."""


def read_summary(folder):
    """The figures of summary.json as a dictionary, every key of SUMMARY_KEYS present."""
    path = Path(folder) / "summary.json"
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ReportError(f"{path} does not exist; tendrild --report {folder} writes it") from None
    except ValueError as error:
        raise ReportError(f"{path} is not JSON ({error}); was the daemon killed while it wrote it?") from None
    missing = [key for key in SUMMARY_KEYS if key not in summary]
    if missing:
        raise ReportError(f"{path} lacks {', '.join(missing)}; was it written by another version of tendrild?")
    return summary


class NoCycle(ReportError):
    """A run that ended before its first control cycle."""


class Trace:
    """The columns of trace.csv, one row a control cycle: numbers as float arrays (NaN where empty), text as lists."""

    def __init__(self, folder):
        self.path = Path(folder) / "trace.csv"
        try:
            with self.path.open(newline="", encoding="utf-8", errors="replace") as file:
                rows = csv.reader(file)
                header = next(rows, [])
                columns = list(zip(*(row for row in rows if len(row) == len(header))))  # a cut last line is left out
        except FileNotFoundError:
            raise ReportError(f"{self.path} does not exist; tendrild --report {folder} writes it") from None
        if not columns:
            raise NoCycle(f"{self.path} holds no cycle: the run ended before the control thread started")
        self._columns = {name: list(cells) if name in TEXT_COLUMNS else self._numbers(name, cells)
                         for name, cells in zip(header, columns)}
        self.actuators = {name[len("command_"):-1 - len(units.displacement)]: units
                          for name in header for units in (METRES, VOLUMES)
                          if name.startswith("command_") and name.endswith(f"_{units.displacement}")}
        self.axes = [a for a in AXES if np.isfinite(self[f"target_{a}_m"]).any()]

    def _numbers(self, name, cells):
        try:
            return np.array([cell or "nan" for cell in cells], dtype=float)
        except ValueError as error:
            raise ReportError(f"{self.path}: column {name} should hold numbers ({error})") from None

    def __getitem__(self, name):
        if name not in self._columns:
            raise ReportError(f"{self.path}: there is no column {name}; the columns are {', '.join(self._columns)}")
        return self._columns[name]

    def position(self, who):
        """Rows x controlled axes, mm; who is target, model or measured."""
        return 1e3 * np.array([self[f"{who}_{a}_m"] for a in self.axes]).reshape(len(self.axes), len(self["t_s"])).T

    def actuator(self, name):
        """Command, measured displacement and effort of an actuator in the solution, in the units that people read."""
        units = self.actuators[name]
        command, measured = (units.displacement_scale * self[f"{what}_{name}_{units.displacement}"]
                             for what in ("command", "displacement"))
        return command, measured, units.effort_scale * self[f"effort_{name}_{units.effort}"]

    def measured_effort(self, name):
        """Times in s and efforts that a sensor told of an actuator, in the unit that people read; none without one."""
        units = self.actuators[name]
        column = self._columns.get(f"measured_{name}_{units.effort}", np.full(len(self["t_s"]), np.nan))
        has = np.isfinite(column)
        return self["t_s"][has], units.effort_scale * column[has]

    def is_running(self):
        """True in the rows of the phase "run", the one that errors are judged in."""
        return np.array(self["phase"]) == "run"

    def phases(self):
        """(name, first, last time in s) of every phase in the order of the run."""
        t, phase = self["t_s"], self["phase"]
        starts = [0] + [i for i in range(1, len(phase)) if phase[i] != phase[i - 1]]
        return [(phase[a], t[a], t[b]) for a, b in zip(starts, starts[1:] + [len(phase) - 1])]

    def sightings(self):
        """What sensors told of the tip in the phase "run": times in s, positions in mm (samples x axes, NaN where an
        axis is not measured), and where the desired tip and the model's tip were at those times."""
        has = (self.is_running() & np.isfinite(self["measured_t_s"])
               & np.isfinite(self.position("measured")).any(axis=1))
        if not has.any():
            empty = np.empty((0, len(self.axes)))
            return np.empty(0), empty, empty, empty
        when = self["measured_t_s"][has]

        def at_samples(who):
            known = np.isfinite(self.position(who)).all(axis=1)
            if not known.any():
                return np.full((len(when), len(self.axes)), np.nan)
            return np.array([np.interp(when, self["t_s"][known], p) for p in self.position(who)[known].T]).T

        return when, self.position("measured")[has], at_samples("target"), at_samples("model")


def deadline_latencies(wakeup, work, period):
    """Latencies of the wake-up at every deadline, those included that a cycle slept through or was still at work at: each
    of these as if it had begun when that cycle ended, as tendrild counts them. All in one unit; one list for all cycles."""
    latencies = []
    for late, took in zip(wakeup, work):
        latencies.append(late)
        missed = late + took - period
        while missed > 0:
            latencies.append(missed)
            missed -= period
    return latencies


def count(number):
    """12000 as "12 000", with the thin spaces of the SI."""
    return f"{number:,}".replace(",", "\u202f")


def number(value, unit=""):
    """Three significant digits and a unit; "not measured" where there is no value."""
    if value is None:
        return "not measured"
    text = f"{value:.3g}" if abs(value) < 1000 else count(round(value))
    return f"{text} {unit}".strip()


def sentence(summary, trace):
    """What happened, in one line for a person; trace is None where there was no control cycle."""
    running = trace.is_running() if trace else np.array(False)
    what = "The tip did not get to follow its path"
    if running.any() and trace.axes:
        target = trace.position("target")[running]
        sides = [s for s in np.nanmax(target, axis=0) - np.nanmin(target, axis=0) if s > 0.5]
        shape = f"a path of {' × '.join(f'{s:.0f}' for s in sides)} mm" if sides else "a fixed point"
        seconds = trace["t_s"][running]
        what = f"The tip of the {summary['robot']} followed {shape} for {seconds[-1] - seconds[0]:.0f} s"
    mean = (summary["tracking_error_mm"] or {}).get("mean")
    error = f"{mean:.1f} mm mean error" if mean is not None else "error not measured"
    cycles, faults, warnings = summary["cycles"], summary["faults"], summary["warnings"]
    fault = f"ended by a fault ({'; '.join(faults)})" if faults else "no fault"
    if warnings:
        fault += f", {len(warnings)} warning{'s' * (len(warnings) > 1)} ({warnings[0]})"
    return f"{what}: {error}, {count(cycles - summary['late_cycles'])} of {count(cycles)} cycles on time, {fault}."
