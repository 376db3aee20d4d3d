# SPDX-License-Identifier: Apache-2.0
"""A robot on a virtual CAN bus beside programs that are not Tendril's, for the tests of this folder.

What may come late is waited for with great patience and never slept for: no test depends on how fast the machine is.
"""

import contextlib
import faulthandler
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from own_interface import own_interface

INTERFACE = "vcan0"  # or one of this test's own, see main
PATIENCE_S = 60 * float(os.environ.get("TENDRIL_PATIENCE", 1))  # as tests/patience.h has it
NO_PYTHON = "/dev/null/none"  # below a device there is no folder on any machine
STRANGER = "7EE"  # an identifier that nobody in a DBC of ours has
# What cangen says for itself: data frames of a stranger, remote frames of any identifier, extended ones.
FLOOD = (("-I", STRANGER, "-L", 8), ("-R",), ("-e",))


def skip(why):
    print(f"skipped: {why}")
    sys.exit(0)


def main():
    """Runs the tests of a script, called with the programs under test: tendrild, tendril-plant."""
    global INTERFACE
    if not Path("/sys/class/net", INTERFACE).exists():
        skip(f"this machine has no {INTERFACE}; tools/vcan brings one")
    INTERFACE = own_interface()
    Program.DAEMON, Program.PLANT = sys.argv[1:3]
    faulthandler.dump_traceback_later(5 * PATIENCE_S, exit=True)  # says where a test hangs
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)


def wait_until(question, what, programs=()):
    """The first answer that is not false; fails where none comes.

    what: that is waited for, or a function that tells it then
    programs: what they have said is told then
    """
    end = time.monotonic() + PATIENCE_S
    while not (answer := question()):
        if time.monotonic() > end:
            said = "".join(f"\n{program.name} said: {program.said()}" for program in programs)
            raise AssertionError(f"waited in vain for {what() if callable(what) else what}{said}")
        time.sleep(0.01)
    return answer


class Program:
    """A program that runs beside the test and writes all it says into a file; killed with the object.

    more: further arguments for Popen
    """

    def __init__(self, arguments, log, **more):
        self.log = Path(log)
        self.name = Path(arguments[0]).name
        with open(self.log, "wb") as output:
            words = [str(word) for word in arguments]
            outputs = {"stdout": output, "stderr": output, **more}
            self.process = subprocess.Popen(words, bufsize=0, stdin=subprocess.PIPE, **outputs)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()

    def said(self):
        return self.log.read_text()

    def wait_for(self, text):
        def found():
            ended = self.process.poll() is not None  # before the look, so that its last words are read
            if text in self.said():
                return True
            if ended:
                raise AssertionError(f"{self.name} ended before '{text}': {self.said()}")
            return False

        wait_until(found, f"'{text}' of {self.name}", [self])

    def write_line(self, line):
        self.process.stdin.write(line.encode() + b"\n")

    def ended(self):
        return self.process.poll() is not None

    def exit_code(self):
        try:
            return self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"{self.name} has not ended; it said: {self.said()}") from None

    def terminate(self):
        self.process.send_signal(signal.SIGTERM)
        return self.exit_code()


def finger(protocol="canopen", changes=()):
    """The text of config/finger.yaml, so patient that a machine which stalls is no fault.

    Its model, which else refreshes as often as it can, leaves the CPU to the other programs.

    changes: pairs of a piece of the text and what stands there instead
    """
    text = (ROOT / "config/finger.yaml").read_text()
    patient = [
        ("file: finger.msh", f"file: {ROOT}/config/finger.msh"),
        ("rate: 600 Hz", "rate: 100 Hz\n  model_rate_limit: 20 Hz\n  iteration_cap: 32"),
        ("snapshot_age_limit: 500 ms", "snapshot_age_limit: 300 s"),
        ("target_age_limit: 500 ms", "target_age_limit: 300 s"),
        ("late_cycles_limit: 20", "late_cycles_limit: 20000"),
        ("heartbeat_timeout: 150 ms", "heartbeat_timeout: 60 s\n  feedback_timeout: 60 s"),
        (
            "  bitrate: 1 Mbit/s\n",
            "  bitrate: 1 Mbit/s\n  boot_timeout: 10 s\n  enable_timeout: 60 s\n  disable_timeout: 10 s\n",
        ),
    ]
    if protocol == "canopen":
        patient += [("  master_node: 127\n", "  master_node: 127\n  sdo_timeout: 30 s\n")]
    if protocol == "odrive":
        patient += [
            ("counts_per_turn: 65536, ", "reference: absolute, "),
            ("  master_node: 127\n", "  protocol: odrive\n"),
            ("  heartbeat: 50 ms\n", ""),
            ("0x1F0", "0x7F0"),  # which node 15 would own
        ]
    for old, new in [*changes, *patient]:
        if old not in text:
            raise AssertionError(f"config/finger.yaml has no '{old}'")
        text = text.replace(old, new)
    # Where one side stalls, an axis lags behind its command.
    return "".join(line if "effort" in line else line.replace("pulley_radius: 5 mm}", "pulley_radius: 5 mm, following_error: 1 m}")
                   for line in text.splitlines(keepends=True))


class Bench:
    """A folder with a robot file, and a simulated robot on the bus that is ready to be talked to."""

    def __init__(self, robot):
        self._folder = tempfile.TemporaryDirectory(prefix="tendril-peers-")
        self.folder = Path(self._folder.name)
        self.robot = self.folder / "robot.yaml"
        self.robot.write_text(robot)
        self.report = self.folder / "report"
        self.plant = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.plant:
            self.plant.__exit__()
        self._folder.cleanup()

    @contextlib.contextmanager
    def flood(self, gap_ms=1):
        """Lets others talk meanwhile, each of them every gap_ms. Use with `with`."""
        with contextlib.ExitStack() as stack:
            cangens = [
                stack.enter_context(
                    Program(["cangen", INTERFACE, "-g", gap_ms, "-i", *kind], self.folder / f"cangen{i}.log")
                )
                for i, kind in enumerate(FLOOD)
            ]
            yield
            for cangen in cangens:
                if cangen.ended():
                    raise AssertionError(f"cangen ended: {cangen.said()}")

    def start_plant(self):
        self.plant = Program([Program.PLANT, self.robot, "--bus", INTERFACE], self.folder / "plant.log")
        self.plant.wait_for("ready\n")

    def share_of_steps_missed(self):
        """For how many of its steps the simulated body was too slow, %, as it says when it ends."""
        return float(re.search(r"too slow for ([0-9.]+) %", self.plant.said())[1])

    def start_daemon(self, *more):
        arguments = [Program.DAEMON, self.robot, "--bus", INTERFACE, "--allow-non-rt", "--report", self.report]
        # Python that does not start draws no pictures of the run, which would take longer than it.
        environment = {**os.environ, "PYTHONHOME": NO_PYTHON}
        return Program([*arguments, *more], self.folder / "daemon.log", env=environment)

    def dbc(self):
        arguments = [Program.DAEMON, self.robot, "--dbc"]
        return subprocess.run(arguments, capture_output=True, text=True, check=True).stdout
