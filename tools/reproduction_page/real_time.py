# SPDX-License-Identifier: Apache-2.0
"""What a run of the daemon on its bus came to, as far as it stands beside those in virtual time."""

import numpy as np
from run_report.run import Trace, read_summary


def roughness(trace, rate):
    """Root mean square of the second differences of the commands at the control rate, mm/s², over the actuators and
    the cycles of phase "run" that came without one missed between them."""
    whole = np.diff(trace["t_s"]) < 1.5 / rate
    use = trace.is_running()[2:] & whole[1:] & whole[:-1]
    second = [np.diff(trace.actuator(name)[0], 2)[use] * rate ** 2 for name in trace.actuators]
    return float(np.sqrt(np.mean(np.square(second))))


def figures(what, folder):
    """The figures of a report folder, ready for JSON."""
    summary = read_summary(folder)
    kept = ("bus", "control_rate_hz", "model_rate_hz", "cycles", "late_cycles", "wakeup_us", "cycle_us", "faults",
            "warnings")
    return {"run": what, **{key: summary[key] for key in kept}, "error_mm": summary["tracking_error_mm"],
            "scheduling": summary["rt"]["policy"], "roughness_mm_s2": roughness(Trace(folder), summary["control_rate_hz"])}
