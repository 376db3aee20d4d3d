#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Commands say what is wrong with their arguments before they install or build anything."""

import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


class UsageTest(unittest.TestCase):
    """Runs the commands in a tree that has none of the others, so that setup and build cannot be reached."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = Path(self.folder.name)
        for name in (
            "tools/validate",
            "tools/bench",
            "tools/reproduce",
            "tools/vcan",
            "tools/rt-kernel",
            "tools/other_kernel.sh",
            "tests/validation/cases.cpp",
        ):
            (self.root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.root / name)

    def run_command(self, name, *arguments):
        environment = {**os.environ, "PATH": f"{self.root}/tools:{os.environ['PATH']}"}
        words = [self.root / "tools" / name, *arguments]
        return subprocess.run(words, capture_output=True, text=True, check=False, env=environment)

    def test_validate_lists_its_cases(self):
        ended = self.run_command("validate", "--list")
        self.assertEqual(ended.returncode, 0, ended.stderr)
        header = (ROOT / "tests/validation/cases.h").read_text()
        declared = [line.split("void ")[1].split("(")[0] for line in header.splitlines() if line.startswith("void ")]
        self.assertEqual(ended.stdout.split(), declared)

    def test_validate_refuses_a_case_that_is_not_there(self):
        ended = self.run_command("validate", "lame", "lamé")
        self.assertEqual((ended.returncode, ended.stdout), (2, ""))
        self.assertIn("there is no case lamé; the cases are patch, ", ended.stderr)

    def test_reproduce_refuses_what_it_does_not_know(self):
        for argument in ("--fast", "square"):
            ended = self.run_command("reproduce", argument)
            self.assertEqual((ended.returncode, ended.stdout), (2, ""))
            self.assertIn(f"unrecognized arguments: {argument}", ended.stderr)

    def test_reproduce_tells_what_it_leaves_behind(self):
        ended = self.run_command("reproduce", "--help")
        self.assertEqual(ended.returncode, 0, ended.stderr)
        for word in ("reproduction.html", "reproduce.json", "--no-real-time", "--out DIR"):
            self.assertIn(word, ended.stdout)

    def test_bench_refuses_what_it_cannot_measure(self):
        for arguments, said in (
            ([], "needs the word model, qp or latency; tools/bench --help explains it"),
            (["rt"], "cannot measure rt, only model, qp and latency; tools/bench --help explains it"),
            (["qp", "--sets"], "--sets needs a value; tools/bench --help explains it"),
            (["latency", "--sets"], "latency does not know --sets; tools/bench --help lists what it does"),
            (["qp", "--growth"], "qp does not know --growth; tools/bench --help lists what it does"),
        ):
            ended = self.run_command("bench", *arguments)
            self.assertEqual(ended.returncode, 2)
            self.assertEqual(ended.stderr, f"bench: {said}\n")

    def test_other_kernels_refuse_what_they_cannot_run(self):
        for name in ("vcan", "rt-kernel"):
            for arguments, said in (
                (["--timeout", "soon", "true"], "--timeout needs whole seconds, not 'soon'"),
                (["--timeout"], "--timeout needs whole seconds, not ''"),
                (["--fast", "true"], f"does not know --fast; tools/{name} --help lists what it does"),
            ):
                ended = self.run_command(name, *arguments)
                self.assertEqual((ended.returncode, ended.stderr), (2, f"{name}: {said}\n"))
            ended = self.run_command(name)
            self.assertEqual(ended.returncode, 2)
            self.assertTrue(ended.stderr.startswith(f"usage: tools/{name} "), ended.stderr)

    def test_the_last_line_of_a_test_run_counts_what_was_skipped(self):
        said = [
            "1/3 Test #1: hal: A frame is a frame ...........   Passed    0.01 sec",
            "2/3 Test #2: hal: A bus is a bus ..............***Skipped   0.01 sec",
            "3/3 Test #3: qp: A passed problem is solved ...   Passed    0.01 sec",
        ]
        runs = 2 if Path("/sys/class/net/vcan0").exists() else 1  # of ctest: on vcan0 where there is one
        logs = ("release (build/release/test.log)", "release (build/release/vcan.log)")
        for lines, last in (
            (said, f"All but {runs} of {3 * runs} tests passed (release), in "),
            (said[::2], f"All {2 * runs} tests passed (release), in "),
            (said + ["ctest fails"], f"FAILED: {', '.join(logs[:runs])}; "),
        ):
            self.replace_programs("".join(f"echo '{line}'\n" for line in lines) + f"exit {int(len(lines) > 3)}\n")
            ended = self.run_command("test", "--quick")
            self.assertIn(last, ended.stdout.splitlines()[-1], ended.stdout + ended.stderr)
            self.assertEqual(ended.returncode, int(last.startswith("FAILED")))

    def replace_programs(self, ctest):
        """tools/test, with nothing to install, build and format, and a ctest that is this script."""
        shutil.copy(ROOT / "tools/test", self.root / "tools/test")
        (self.root / "build/release").mkdir(parents=True, exist_ok=True)
        scripts = {"setup": "", "build": "", "vcan": 'exec "$@"\n', "ctest": ctest, "clang-format": ""}
        for name, script in scripts.items():
            path = self.root / "tools" / name
            path.write_text("#!/bin/bash\n" + script)
            path.chmod(0o755)


if __name__ == "__main__":
    sys.exit(unittest.main())
