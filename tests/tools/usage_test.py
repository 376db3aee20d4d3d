#!/usr/bin/python3
"""Commands say what is wrong with their arguments before they install or build anything."""

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
            "tools/vcan",
            "tools/rt-kernel",
            "tools/other_kernel.sh",
            "tests/validation/cases.cpp",
        ):
            (self.root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.root / name)

    def run_command(self, name, *arguments):
        return subprocess.run([self.root / "tools" / name, *arguments], capture_output=True, text=True, check=False)

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


if __name__ == "__main__":
    sys.exit(unittest.main())
