#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A running robot is operated through its control socket: by tendrilctl, by the Python client, and by line noise."""

import base64
import contextlib
import faulthandler
import json
import math
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import jsonschema

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests/peers"), str(ROOT / "app/client")]
from bench import PATIENCE_S, Program, finger, wait_until
from tendril import ControlLost, Refused, Robot

DAEMON, PLANT, CTL = (sys.argv.pop(1) for _ in range(3))
SCHEMA = jsonschema.Draft202012Validator(json.loads((ROOT / "docs/control-protocol.schema.json").read_text()))


class CheckedRobot(Robot):
    """The Python client, with every message held against the schema."""

    def _ask(self, command, **more):
        SCHEMA.validate({"id": 1, "version": 1, "command": command, **more})
        return super()._ask(command, **more)

    def _read(self):
        message = super()._read()
        SCHEMA.validate(message)
        return message


class OperateTest(unittest.TestCase):
    """One robot for all tests of the class; each takes the control and leaves the robot where it wants."""

    @classmethod
    def setUpClass(cls):
        cls.stack = contextlib.ExitStack()
        folder = Path(cls.stack.enter_context(tempfile.TemporaryDirectory(prefix="tendril-operate-")))
        cls.socket = folder / "finger.sock"
        robot = folder / "finger.yaml"
        robot.write_text(finger())
        bus = f"local:{folder}/bus"
        cls.plant = cls.stack.enter_context(Program([PLANT, robot, "--bus", bus], folder / "plant.log"))
        cls.plant.wait_for("ready")
        cls.daemon = cls.stack.enter_context(
            Program([DAEMON, robot, "--bus", bus, "--allow-non-rt", "--socket", cls.socket], folder / "daemon.log")
        )
        cls.daemon.wait_for("phase: run")

    @classmethod
    def tearDownClass(cls):
        cls.stack.close()

    def robot(self):
        return self.enterContext(CheckedRobot(self.socket, timeout=PATIENCE_S))

    def ctl(self, *words):
        return subprocess.run(
            [CTL, *map(str, words), "--socket", self.socket], capture_output=True, text=True, timeout=PATIENCE_S, check=False
        )

    def comes_to(self, robot, goal):
        """The first state in which target and model are at a goal."""
        for state in robot.states(rate=100):
            if all(abs(state[which][name] - value) < 1e-5 for which in ("target", "model") for name, value in goal.items()):
                return state
        raise AssertionError("unreachable")

    def test_a_target_is_reached_by_the_model_and_nearly_by_the_robot(self):
        robot = self.robot()
        names = robot.coordinates
        start = robot.status()["model"]
        robot.acquire()
        goal = {names[0]: start[names[0]] + 0.004}
        robot.target(goal, speed=0.02)
        state = self.comes_to(robot, goal)
        self.assertEqual(state["mode"], "target")
        self.assertIn("python", Path(f"/proc/{state['control'].split()[-1].strip(')')}/comm").read_text())
        for name in names[1:]:
            self.assertAlmostEqual(state["target"][name], start[name], delta=2e-3)

        def seen():
            measured = robot.status()["measured"].get(names[0])
            return measured and abs(measured["value"] - goal[names[0]]) < 1.5e-3

        wait_until(seen, "the tip near its target", [self.daemon, self.plant])

    def test_the_body_is_shown_as_it_moves(self):
        robot = self.robot()
        geometry = robot._ask("geometry")["geometry"]
        self.assertEqual(geometry["robot"], robot.name)
        nodes = len(geometry["surface"]["nodes_mm"])
        points = sum(len(each.get("points", ())) for each in geometry["actuators"] + geometry["effectors"])
        robot._ask("surface", rate=30)

        def positions():
            while "surface" not in (message := robot._next()):
                pass
            surface = message["surface"]
            numbers = struct.unpack(f"<{3 * (nodes + points)}H", base64.b64decode(surface["positions"]))
            return [surface["origin"][k % 3] + surface["step"] * number for k, number in enumerate(numbers)]

        before = positions()
        robot.acquire()
        name = robot.coordinates[0]
        robot.target({name: robot.status()["target"][name] + 0.003}, within=0.1)
        end = time.monotonic() + PATIENCE_S
        while max(abs(a - b) for a, b in zip(positions(), before)) < 0.002:
            self.assertLess(time.monotonic(), end)
        robot._ask("surface", rate=0)

    def test_a_stream_moves_the_robot_along_a_circle(self):
        robot = self.robot()
        robot.acquire()
        robot.hold()
        name = robot.coordinates[0]
        middle = robot.status()["target"][name]
        positions = [{name: middle + 0.002 * math.sin(2 * math.pi * k / 100)} for k in range(101)]
        robot.stream(positions, rate=100)
        self.comes_to(robot, positions[-1])

    def test_the_example_of_a_circle_ends_where_it_began(self):
        robot = self.robot()
        robot.acquire()
        robot.hold()
        start = next(robot.states())["target"]
        robot.release()
        subprocess.run([ROOT / "app/client/examples/circle.py", self.socket, "1"], timeout=PATIENCE_S, check=True)
        self.comes_to(robot, start)

    def test_a_client_that_dies_leaves_the_robot_at_its_last_target(self):
        script = "import sys, time; sys.path.insert(0, sys.argv[1]); from tendril import Robot; r = Robot(sys.argv[2]); " \
                 "r.acquire(); r.target({r.coordinates[0]: float(sys.argv[3])}, within=0.2); print('sent', flush=True); time.sleep(1000)"
        watcher = self.robot()
        name = watcher.coordinates[0]
        goal = watcher.status()["model"][name] + 0.003
        words = [sys.executable, "-c", script, ROOT / "app/client", self.socket, repr(goal)]
        with subprocess.Popen(list(map(str, words)), stdout=subprocess.PIPE, text=True) as client:
            self.assertEqual(client.stdout.readline(), "sent\n")
            with self.assertRaises(Refused) as refusal:
                watcher.acquire()
            self.assertEqual(refusal.exception.code, "control_taken")
            client.send_signal(signal.SIGKILL)
        wait_until(lambda: watcher.status()["control"] is None, "the control to be free", [self.daemon])
        self.comes_to(watcher, {name: goal})
        watcher.acquire()

    def test_the_control_can_be_taken_away(self):
        first, second = self.robot(), self.robot()
        first.acquire()
        second.acquire(steal=True)
        with self.assertRaises(ControlLost):
            for _ in first.states(rate=100):
                pass
        with self.assertRaises(Refused):
            first.hold()

    def test_tendrilctl_shows_and_moves_the_robot(self):
        shown = self.ctl("status")
        self.assertEqual(shown.returncode, 0, shown.stderr)
        self.assertIn("phase run", shown.stdout)
        state = json.loads(self.ctl("status", "--json").stdout)
        SCHEMA.validate({"state": state})
        here = [1e3 * value for value in state["target"].values()]
        moved = self.ctl("target", *(f"{value + 1:.4f}" for value in here[:1]), *(f"{value:.4f}" for value in here[1:]), "--in", "0.2")
        self.assertEqual(moved.returncode, 0, moved.stderr)
        self.assertIn("mode target", moved.stdout)
        for command in (["hold"], ["pause"], ["resume"], ["speed", "50"]):
            self.assertEqual(self.ctl(*command).returncode, 0, command)
        refused = self.ctl("target", *(1e6 for _ in here))
        self.assertEqual(refused.returncode, 1)
        self.assertIn("outside control.workspace", refused.stderr)
        self.assertEqual(self.ctl("target", "1").returncode, 1 if len(here) > 1 else 0)
        robot = self.robot()
        robot.acquire()
        self.assertIn("has the control", self.ctl("hold").stderr)
        self.assertEqual(self.ctl("hold", "--steal").returncode, 0)

    def test_a_trajectory_is_played_to_its_end(self):
        robot = self.robot()
        name = robot.coordinates[0]
        middle = 1e3 * robot.status()["target"][name]
        way = self.socket.parent / "way.csv"
        way.write_text(f"t [s], {name} [mm]\n0, {middle}\n0.3, {middle + 2}\n0.8, {middle - 1}\n")
        played = self.ctl("play", way, "--percent", 200)
        self.assertEqual(played.returncode, 0, played.stderr)
        self.comes_to(robot, {name: 1e-3 * (middle - 1)})
        way.write_text(f"t [s], {name} [mm]\n0, {middle}\n1, 1e6\n")
        refused = self.ctl("play", way)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("outside control.workspace", refused.stderr)
        way.write_text("t, knee\n0, 0\n")
        self.assertEqual(self.ctl("play", way).returncode, 2)

    def test_noise_and_floods_leave_the_robot_as_it_was(self):
        robot = self.robot()
        robot.acquire()
        robot.hold()
        before = next(robot.states())  # of a cycle after that
        quit_ = threading.Event()

        def flood(line):
            with socket.socket(socket.AF_UNIX) as client:
                client.connect(str(self.socket))
                client.settimeout(0.1)
                while not quit_.is_set():
                    with contextlib.suppress(TimeoutError):  # it never reads
                        client.sendall(100 * line)

        lines = [b'{"command":"status"}\n', b'{"command":"target","position":{"tip.x":0}}\n', b"\xff\x00{\n", 20_000 * b"["]
        threads = [threading.Thread(target=flood, args=[line]) for line in lines]
        idle = [self.enterContext(socket.socket(socket.AF_UNIX)) for _ in range(10)]
        for client in idle:
            client.connect(str(self.socket))
        for thread in threads:
            thread.start()
        try:
            for _, state in zip(range(20), robot.states(rate=20)):
                self.assertEqual(state["phase"], "run")
                for name, value in before["target"].items():
                    self.assertAlmostEqual(state["target"][name], value, delta=1e-9)
        finally:
            quit_.set()
            for thread in threads:
                thread.join()
        self.assertEqual(robot.status()["mode"], "hold")

    def test_a_fault_waits_for_a_reset_and_nothing_moves_at_it(self):
        robot = self.robot()
        robot.acquire()
        name = robot.coordinates[0]
        goal = {name: robot.status()["model"][name] + 0.002}
        robot.target(goal, within=0.2)
        self.comes_to(robot, goal)
        self.assertEqual(self.ctl("faults").stdout, "no fault\n")
        self.plant.write_line("fault left emcy 0x2310")
        state = next(state for state in robot.states(rate=100) if state["phase"] == "standby")
        self.assertIn("'left'", state["fault"]["what"])
        self.assertIn("EMCY 2310", state["fault"]["what"])
        told = self.ctl("faults")
        self.assertEqual(told.returncode, 1)
        self.assertIn(state["fault"]["do"], told.stdout)
        with self.assertRaises(Refused) as refusal:
            robot.target(goal)
        self.assertEqual(refusal.exception.code, "not_running")
        self.assertIn("waits for a reset", self.daemon.said())
        stood = next(s for s in robot.states(rate=100) if all(a["power"] == "off" for a in s["actuators"].values()))
        robot.release()
        reset = self.ctl("reset")
        self.assertEqual(reset.returncode, 0, reset.stderr)
        state = robot.status()
        self.assertEqual((state["phase"], state["mode"], state["fault"]), ("run", "hold", None))
        for actuator, then in stood["actuators"].items():
            self.assertAlmostEqual(state["actuators"][actuator]["command"], then["displacement"], delta=1e-5)
        robot.acquire()
        robot.target(goal, within=0.2)
        self.comes_to(robot, goal)

    def test_drives_are_disabled_and_enabled(self):
        self.assertEqual(self.ctl("disable").returncode, 0)
        robot = self.robot()
        state = robot.status()
        self.assertEqual(state["phase"], "standby")
        self.assertIsNone(state["fault"])
        self.assertEqual({a["power"] for a in state["actuators"].values()}, {"off"})
        self.assertEqual(self.ctl("enable").returncode, 0)
        self.assertEqual(robot.status()["phase"], "run")

    def test_zz_stop_ends_the_daemon_with_its_drives_off(self):
        robot = self.robot()
        self.assertEqual(self.ctl("stop").returncode, 0)
        self.assertEqual(self.daemon.exit_code(), 0)
        self.assertIn("drives disabled", self.daemon.said())
        with self.assertRaises(ConnectionError):
            while True:
                robot.status()
        self.assertFalse(self.socket.exists())
        gone = self.ctl("status")
        self.assertEqual(gone.returncode, 3)
        self.assertIn("no daemon at", gone.stderr)


if __name__ == "__main__":
    faulthandler.dump_traceback_later(5 * PATIENCE_S, exit=True)  # says where a test hangs
    unittest.main(verbosity=2)
