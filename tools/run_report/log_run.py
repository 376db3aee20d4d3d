# SPDX-License-Identifier: Apache-2.0
"""The report files of a run, trace.csv and summary.json, from its log."""

import csv
import itertools
import json
import math
from array import array
from collections import Counter

from .mcap import Log, McapError
from .run import AXES, ReportError, deadline_latencies

RUNNING = ("approach", "run")
PERCENTILES = (50, 99, 99.9)


def nearest_rank(values, percent):
    """The least of sorted values that so many percent of them do not exceed."""
    return values[max(0, math.ceil(percent / 100 * len(values) * (1 - 1e-12)) - 1)]


def percentiles_us(seconds):
    if not seconds:
        return {**{f"p{p:g}": 0 for p in PERCENTILES}, "max": 0}
    values = sorted(seconds)
    return {**{f"p{p:g}": 1e6 * nearest_rank(values, p) for p in PERCENTILES}, "max": 1e6 * values[-1]}


def statistics(values, scale, *more):
    """mean, max, samples, and p95 where it is wanted; None without values."""
    if not values:
        return None
    ordered = sorted(values)
    figures = {"mean": scale * math.fsum(values) / len(values), "max": scale * ordered[-1], "samples": len(values)}
    return {**figures, **{name: scale * nearest_rank(ordered, 95) for name in more}}


class TraceRows:
    """trace.csv, row by row: what a cycle and the samples that came with it tell."""

    def __init__(self, file, log):
        run, units = log.metadata["run"], log.metadata["effort_units"]
        self.tip = run["tip"]
        self.units = {name: ("m3" if effort == "Pa" else "m", effort) for name, effort in units.items()}
        measured = [(name, what) for topic, schema in log.schemas.items() if topic.startswith("/sensors/")
                    for name, group in schema["properties"].items() for what in group["properties"]]
        self.efforts = {name for name, what in measured if what == "effort"}
        self.others = [(name, what) for name, what in measured if what in AXES and name != self.tip]
        self.actuators = list(log.schemas["/state"]["properties"]["actuators"]["properties"])
        self._rows = csv.writer(file, lineterminator="\n")
        self._rows.writerow(self._header())
        self._first_ns = self._state = None

    def _header(self):
        columns = ["t_s", "phase", *(f"{who}_{a}_m" for who in ("target", "model", "measured") for a in AXES), "measured_t_s"]
        for name in self.actuators:
            displacement, effort = self.units[name]
            columns += [f"command_{name}_{displacement}", f"displacement_{name}_{displacement}", f"effort_{name}_{effort}"]
            columns += [f"measured_{name}_{effort}"] * (name in self.efforts)
        columns += [f"measured_{name}_{axis}_m" for name, axis in self.others]
        return columns + ["qp_status", "qp_iterations", "snapshot_age_s", "wakeup_us", "cycle_us"]

    def add(self, message):
        if message.topic == "/state":
            self.flush()
            self._state, self._samples, self._newest_ns = message, {}, None
            self._first_ns = self._first_ns or message.log_ns
        elif message.topic.startswith("/sensors/") and self._state:
            for name, group in message.data.items():
                self._samples.update({(name, what): value for what, value in group.items()})
                if name == self.tip and any(axis in AXES for axis in group):
                    self._newest_ns = max(self._newest_ns or 0, message.publish_ns)

    def flush(self):
        """The row of the last cycle, once all that belongs to it is there."""
        if not self._state:
            return
        state, sample = self._state.data, lambda *key: self._samples.get(key, "")
        row = [round(1e-9 * (self._state.log_ns - self._first_ns), 9),
               "stop" if state["phase"] in ("disable", "stopped") else state["phase"]]
        for who in ("target", "model"):
            row += [state.get(who, {}).get(self.tip, {}).get(axis, "") for axis in AXES]
        row += [sample(self.tip, axis) for axis in AXES]
        row.append("" if self._newest_ns is None else round(1e-9 * (self._newest_ns - self._first_ns), 9))
        for name in self.actuators:
            row += state["actuators"][name].values()
            row += [sample(name, "effort")] * (name in self.efforts)
        row += [sample(*key) for key in self.others]
        timing = state["timing"]
        row += [state["qp"]["status"] or "", state["qp"]["iterations"], state["snapshot"]["age"],
                1e6 * timing["wakeup"], 1e6 * timing["work"]]
        self._rows.writerow(row)
        self._state = None


class Figures:
    """What summary.json tells, counted message by message."""

    def __init__(self, period_s, fault_words):
        self._period_s, self._fault_words = period_s, fault_words
        self.wakeup, self.work = array("d"), array("d")
        self.to_path, self.to_model, self.effort = array("d"), array("d"), {}
        self.statuses, self.fault_cycles = Counter(), Counter()
        self.iterations_max = self.bus_bits = 0
        self.first = self.last = self.running_ns = None
        self.status, self.end = {}, None

    def add(self, message):
        data = message.data
        if message.topic == "/state":
            self._add_cycle(message.log_ns, data)
        elif message.topic == "/errors":
            if tip := data.get("tip"):
                self.to_path.append(tip["to_path"])
                self.to_model.append(tip["to_model"])
            for name, error in data.get("effort", {}).items():
                self.effort.setdefault(name, array("d")).append(error)
        elif message.topic == "/status":
            self.status = data
        elif message.topic == "/end":
            self.end = data

    def _add_cycle(self, log_ns, state):
        self.first, self.last = self.first or state, state
        timing = state["timing"]
        latencies = deadline_latencies([timing["wakeup"]], [timing["work"]], self._period_s)
        self.wakeup.extend(latencies)
        self.work.append(timing["work"])
        if state["phase"] not in RUNNING:
            return
        if self.running_ns is None:
            self.running_ns = [log_ns, log_ns]
        else:
            self.bus_bits += state["bus_bits"]
        self.running_ns[1] = log_ns
        self.statuses[state["qp"]["status"]] += 1
        self.iterations_max = max(self.iterations_max, state["qp"]["iterations"])
        for bit in self._fault_words:
            self.fault_cycles[bit] += bool(state["faults"] & int(bit))

    def running_s(self):
        return 1e-9 * (self.running_ns[1] - self.running_ns[0]) if self.running_ns else 0

    def warnings(self):
        said = [f"{words} ({self.fault_cycles[bit]} cycles)" for bit, text in self._fault_words.items()
                for reaction, words in [text.split(": ", 1)] if reaction != "stop" and self.fault_cycles[bit]]
        if self.end is None:
            said.append("the log ends before the run does")
        for what, name in (("trace_dropped", "cycles"), ("log_dropped", "messages")):
            if self.status.get(what):
                said.append(f"{self.status[what]} {name} are missing from the log")
        return said


def summary_of(log, figures):
    """The figures as tendrild --report has them in summary.json, of what the log holds."""
    run, end, status, last = log.metadata["run"], figures.end or {}, figures.status, figures.last
    units = log.metadata["effort_units"]
    before = figures.first["cycles"] - 1 - figures.first["missed"], figures.first["late_cycles"] - figures.first["missed"]
    cycles, late = last["cycles"] - before[0], last["late_cycles"] - before[1]
    running_s = figures.running_s()
    effort = {name: {**statistics(errors, 1), "unit": units[name]} for name, errors in figures.effort.items()}
    return {
        **{key: run[key] for key in ("robot", "configuration", "bus")},
        **{key: int(run[key]) for key in ("nodes", "tetrahedra", "effector_dofs")},
        "actuators": len(units), "control_rate_hz": float(run["control_rate_hz"]), "duration_s": running_s,
        "cycles": cycles, "late_cycles": late, "success_rate": 1 - late / cycles,
        "model_refreshes": status.get("model_refreshes", 0), "model_rate_hz": status.get("model_rate", 0),
        "tracking_error_mm": statistics(figures.to_path, 1e3, "p95"),
        "model_error_mm": statistics(figures.to_model, 1e3), "effort_error": effort,
        "sensors": {name: {"losses": sensor["losses"], "stale_s": sensor["stale"]}
                    for name, sensor in status.get("sensors", {}).items()},
        "qp": {"iterations_max": figures.iterations_max, "statuses": {s: n for s, n in figures.statuses.items() if s},
               "cap": int(run["iteration_cap"])},
        "rt": {"policy": end.get("policy", "not told"), "priority": end.get("priority", "not told"),
               "memory_locked": run["memory_locked"] == "true", "heap_calls": last["heap_calls"],
               "major_faults": end.get("major_faults"), "minor_faults": end.get("minor_faults")},
        "wakeup_us": percentiles_us(figures.wakeup), "cycle_us": percentiles_us(figures.work),
        "bus_load": figures.bus_bits / running_s / float(run["bitrate"]) if running_s else 0,
        "trace_dropped": status.get("trace_dropped", 0), "bus_dropped": end.get("bus_dropped"),
        "faults": [end["stop_reason"]] if end.get("stop_reason") else [], "warnings": figures.warnings(),
    }


def unpack(path, folder):
    """Writes trace.csv and summary.json of a log into a folder, which is made. @throws ReportError"""
    log = Log(path)
    try:
        messages = log.messages()
        first = next(messages, None)
        if first is None:
            raise ReportError(f"{path} holds no message")
        if "run" not in log.metadata or "/state" not in log.schemas:
            raise ReportError(f"{path} is not a log of tendrild")
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / "trace.csv").open("w", newline="", encoding="utf-8") as file:
            rows, figures = TraceRows(file, log), Figures(1 / float(log.metadata["run"]["control_rate_hz"]),
                                                          log.metadata["faults"])
            for message in itertools.chain([first], messages):
                rows.add(message)
                figures.add(message)
            rows.flush()
    except OSError as error:
        raise ReportError(f"{error.filename or path}: {error.strerror}") from None
    except McapError as error:
        raise ReportError(str(error)) from None
    if figures.last is None:
        raise ReportError(f"{path} holds no cycle: the run ended before the control thread started")
    text = json.dumps(summary_of(log, figures), indent=2)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
