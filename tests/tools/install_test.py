#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What `cmake --install` puts on a machine works there, without the source tree."""

import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

CMAKE, BUILD = sys.argv.pop(1), sys.argv.pop(1)
PATIENCE_S = 60 * float(os.environ.get("TENDRIL_PATIENCE", 1))  # as tests/patience.h has it


def run(*words):
    words = [str(word) for word in words]
    ended = subprocess.run(words, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    if ended.returncode != 0:
        raise AssertionError(f"{words[0]} ended with {ended.returncode}: {ended.stderr}")
    return ended.stdout


class InstallTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name) / "usr"
        run(CMAKE, "--install", BUILD, "--prefix", self.root)

    def test_programs_and_what_systemd_reads_are_there(self):
        for program in ("tendrild", "tendril-plant", "tendrilctl", "tendril-latency"):
            self.assertRegex(run(self.root / "bin" / program, "--version"), r"^\d+[.]\d+")
        if (Path(BUILD) / "app/tendril-view").exists():
            self.assertRegex(run(self.root / "bin/tendril-view", "--version"), r"^\d+[.]\d+")
            self.assertTrue((self.root / "share/tendril/view/index.html").is_file())
            self.assertFalse((self.root / "share/tendril/view/node_modules").exists())
        for file in ("systemd/system/tendrild@.service", "sysusers.d/tendril.conf", "udev/rules.d/60-tendril.rules"):
            self.assertTrue((self.root / "lib" / file).is_file(), file)
        keyboard = self.root / "share/tendril/examples/keyboard.py"
        self.assertIn("page up/down", run(keyboard, "--help"))  # it finds tendril.py
        for file in ("tendril.py", "grafana-dashboard.json", "prometheus-rules.yml"):
            self.assertTrue((self.root / "share/tendril" / file).is_file(), file)

    def test_a_report_is_drawn_by_what_was_installed(self):
        tool = self.root / "libexec/tendril/report"
        self.assertIn("report.html", run(tool, "--help"))  # all of its modules are there
        drawn = self.root / "drawn"
        tool.write_text(f'#!/bin/sh\necho "$1" >{drawn}\n')
        report = self.root / "report"
        run(self.root / "bin/tendril-latency", "--timer", "--duration", 0.1, "--allow-non-rt", "--report", report)
        self.assertEqual(drawn.read_text(), f"{report}\n")


if __name__ == "__main__":
    sys.exit(unittest.main())
