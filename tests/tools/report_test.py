#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What pictures of a run tell is what its summary tells."""

import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
try:
    from run_report import pictures
    from run_report.run import Trace, deadline_latencies
except ImportError as problem:
    print(f"skipped: Python's {problem.name} is not installed; tools/setup installs it")
    sys.exit(0)

HEADER = "t_s,phase,target_x_m,target_y_m,target_z_m,qp_iterations,snapshot_age_s,wakeup_us,cycle_us"


def trace_of(latencies):
    """The trace of a run at 1 kHz: (wake-up, work) of each cycle, us."""
    with tempfile.TemporaryDirectory() as folder:
        rows = [f"{0.001 * k},run,0,0,0,1,0.01,{wakeup},{work}" for k, (wakeup, work) in enumerate(latencies)]
        (Path(folder) / "trace.csv").write_text("\n".join([HEADER, *rows, ""]))
        return Trace(folder)


class ReportTest(unittest.TestCase):
    def test_a_stall_counts_for_every_deadline_that_it_covers(self):
        self.assertEqual(deadline_latencies([100, 5], [3500, 30], 1000), [100, 2600, 1600, 600, 5])
        self.assertEqual(deadline_latencies([100], [900], 1000), [100])  # it ends at the next deadline, in time

    def test_the_picture_of_latencies_marks_the_figures_of_the_summary_and_shows_every_deadline(self):
        trace = trace_of([(40, 30)] * 100 + [(100, 5900)] + [(40, 30)] * 100)
        figures = {"p50": 41.5, "p99": 4000, "p99.9": 5010, "max": 5020}
        work = {"p50": 30.5, "p99": 31, "p99.9": 5901, "max": 5902}
        figure = pictures.timing(trace, {"control_rate_hz": 1000, "wakeup_us": figures, "cycle_us": work})
        self.addCleanup(pictures.plt.close, figure)
        for axes, told, count in ((figure.axes[0], figures, 201 + 5), (figure.axes[1], work, 201)):
            marks = [line.get_xdata()[0] for line in axes.get_lines()]
            self.assertEqual(marks, [told["p50"], told["p99.9"], told["max"]])
            self.assertEqual(sum(bar.get_height() for bar in axes.patches), count)


if __name__ == "__main__":
    unittest.main()
