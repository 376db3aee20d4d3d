#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What a running daemon tells Prometheus is what promtool wants, and what dashboard and alerts ask for is in it.

usage: metrics_test.py TENDRILD PLANT
"""

import faulthandler
import json
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import urllib.error
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests/peers"))
from bench import PATIENCE_S, Program, finger, wait_until

DAEMON, PLANT = sys.argv[1:3]
CONFIG = ROOT / "config"
NAME = re.compile(r"\b(?:tendril|process)_\w+")
SAMPLE = re.compile(r"^(\w+)(?:\{(.*)\})? (\S+)$")


def promtool(*words, text=None):
    if not shutil.which("promtool"):
        raise unittest.SkipTest("promtool of Debian's package prometheus is not installed")
    return subprocess.run(["promtool", *map(str, words)], input=text, capture_output=True, text=True, check=False)


def samples(text):
    """{(name, labels): value} of all samples."""
    found = {}
    for line in text.splitlines():
        if not line.startswith("#"):
            name, labels, value = SAMPLE.match(line).groups()
            found[name, labels or ""] = float(value)
    return found


class MetricsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="tendril-metrics-")))
        robot = folder / "finger.yaml"
        robot.write_text(finger())
        bus = f"local:{folder}/bus"
        plant = cls.enterClassContext(Program([PLANT, robot, "--bus", bus], folder / "plant.log"))
        plant.wait_for("ready")
        words = [DAEMON, robot, "--bus", bus, "--allow-non-rt", "--metrics", "0", "--log", folder / "finger.mcap"]
        cls.daemon = cls.enterClassContext(Program(words, folder / "daemon.log"))
        cls.daemon.wait_for("phase: run")
        cls.url = re.search(r"metrics: (\S+)", cls.daemon.said())[1]

    def scrape(self):
        with urllib.request.urlopen(self.url, timeout=PATIENCE_S) as answer:
            self.assertEqual(answer.headers["Content-Type"], "text/plain; version=0.0.4; charset=utf-8")
            return answer.read().decode()

    def test_promtool_has_nothing_to_say(self):
        checked = promtool("check", "metrics", text=self.scrape())
        self.assertEqual((checked.returncode, checked.stdout + checked.stderr), (0, ""))

    def test_counters_count_and_histograms_hold_every_deadline(self):
        before = samples(self.scrape())

        def later():
            now = samples(self.scrape())
            return now if now["tendril_cycles_total", ""] > before["tendril_cycles_total", ""] + 50 else None

        after = wait_until(later, "fifty cycles more", [self.daemon])
        for key, value in after.items():
            if key[0].endswith(("_total", "_bucket", "_count")):
                self.assertGreaterEqual(value, before[key], key)
        cycles = after["tendril_cycles_total", ""]
        self.assertEqual(after["tendril_wakeup_latency_seconds_count", ""], cycles)
        self.assertEqual(after["tendril_cycle_work_seconds_count", ""], cycles - after["tendril_late_cycles_total", ""])
        for family in ("tendril_wakeup_latency_seconds", "tendril_cycle_work_seconds", "tendril_tip_error_meters"):
            counts = [value for (name, _), value in after.items() if name == f"{family}_bucket"]
            self.assertEqual(counts, sorted(counts))
            self.assertEqual(counts[-1], after[f"{family}_count", ""])
        self.assertGreater(after["tendril_tip_error_meters_count", ""], 0)
        self.assertEqual(after["tendril_phase", 'phase="run"'], 1)
        self.assertEqual(sum(value for (name, _), value in after.items() if name == "tendril_phase"), 1)
        self.assertIn(("tendril_info", 'robot="finger",version="0.1.0"'), after)
        self.assertGreater(after["tendril_log_written_bytes_total", ""], 0)
        self.assertEqual(after["tendril_log_dropped_messages_total", ""], 0)

    def test_dashboard_and_alerts_ask_for_what_is_told(self):
        told = {name for name, _ in samples(self.scrape())}
        panels = json.loads((CONFIG / "grafana-dashboard.json").read_text())["panels"]
        asked = [target["expr"] for panel in panels for target in panel["targets"]]
        asked += re.findall(r"expr: (?:\|\n)?((?:.|\n)*?)\n        (?:for|labels):", (CONFIG / "prometheus-rules.yml").read_text())
        self.assertGreater(len(asked), 20)
        for expression in asked:
            for name in NAME.findall(expression):
                self.assertIn(name, told, expression)

    def test_promtool_accepts_the_alerts(self):
        checked = promtool("check", "rules", CONFIG / "prometheus-rules.yml")
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)

    def test_every_metric_is_in_the_manual(self):
        manual = (ROOT / "docs/logs.md").read_text()
        for name, _ in samples(self.scrape()):
            family = re.sub(r"_(bucket|sum|count)$", "", name)
            self.assertIn(f"`{family}", manual)

    def test_nothing_else_is_answered(self):
        with self.assertRaises(urllib.error.HTTPError) as refusal:
            urllib.request.urlopen(self.url.removesuffix("metrics"), timeout=PATIENCE_S)
        self.assertEqual(refusal.exception.code, 404)
        refusal.exception.close()


if __name__ == "__main__":
    faulthandler.dump_traceback_later(5 * PATIENCE_S, exit=True)  # says where a test hangs
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
