#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The examples of the Python client: what keys, sticks and pictures do, and how the programs end."""

import contextlib
import curses
import math
import os
import pty
import signal
import subprocess
import sys
import unittest

os.environ["MPLBACKEND"] = "Agg"
from fake_daemon import OFFSET_M, PATIENCE_S, ROOT, FakeDaemon, wait_until
from joystick import AXIS, BUTTON, EVENT, INITIAL, RATE, Drive, Stick
from keyboard import Keyboard, screen_of
from tendril import Refused, Robot

EXAMPLES = ROOT / "app/client/examples"


class ExampleTest(unittest.TestCase):
    def setUp(self):
        self.daemon = self.enterContext(FakeDaemon())
        self.robot = self.enterContext(Robot(self.daemon.path, timeout=PATIENCE_S))

    def asked(self, command):
        return [request for request in self.daemon.requests if request["command"] == command]

    def example(self, name, *words, **more):
        process = subprocess.Popen(
            [sys.executable, EXAMPLES / name, self.daemon.path, *words], stderr=subprocess.PIPE, text=True, **more)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def ended(self, process):
        """Exit code and last words."""
        try:
            said = process.communicate(timeout=PATIENCE_S)[1]
        except subprocess.TimeoutExpired:
            raise AssertionError(f"{process.args} has not ended") from None
        return process.returncode, said.strip()


class CircleTest(ExampleTest):
    def test_every_target_is_on_the_circle_and_ctrl_c_ends_it(self):
        process = self.example("circle.py")
        wait_until(lambda: len(self.asked("target")) > 20, "targets")
        process.send_signal(signal.SIGINT)
        self.assertEqual(self.ended(process), (0, ""))
        for target in self.asked("target"):
            x, y = (target["position"][f"tip.{axis}"] for axis in "xy")
            self.assertAlmostEqual(math.hypot(x, y - 0.004), 0.004)

    def test_a_robot_that_stops_and_a_daemon_that_ends_are_told(self):
        process = self.example("circle.py")
        wait_until(lambda: self.asked("target"), "a target")
        self.daemon.phase = "stop"
        self.assertEqual(self.ended(process), (1, "circle: the robot does not follow"))
        self.daemon.phase = "run"
        count = len(self.asked("target"))
        process = self.example("circle.py")
        wait_until(lambda: len(self.asked("target")) > count, "a target")
        self.daemon.end()
        code, said = self.ended(process)
        self.assertEqual(code, 1)
        self.assertRegex(said, "^circle: the daemon .*$")


class KeyboardTest(ExampleTest):
    def setUp(self):
        super().setUp()
        self.robot.acquire()
        self.keyboard = Keyboard(self.robot, "tip", step=0.001, speed=0.02)

    def test_each_key_moves_the_target_by_a_step_from_the_last_one(self):
        for key in (curses.KEY_RIGHT, curses.KEY_RIGHT, curses.KEY_LEFT, curses.KEY_UP, curses.KEY_PPAGE, curses.KEY_NPAGE):
            self.keyboard.press(key)
        moves = [next(iter(target["position"].items())) for target in self.asked("target")]
        goals = [("tip.x", 0.001), ("tip.x", 0.002), ("tip.x", 0.001), ("tip.y", 0.001), ("tip.z", 0.001), ("tip.z", 0.0)]
        for (name, value), (wanted_name, wanted) in zip(moves, goals, strict=True):
            self.assertEqual(name, wanted_name)
            self.assertAlmostEqual(value, wanted)
        self.assertEqual({target["speed"] for target in self.asked("target")}, {0.02})

    def test_after_hold_and_after_a_refusal_steps_begin_where_the_robot_is_wanted(self):
        self.keyboard.speed = 1e-6  # so that it does not get there
        self.keyboard.press(curses.KEY_RIGHT)
        self.assertEqual(self.keyboard.press(ord(" ")), "the robot holds")
        held = self.daemon.target()["tip.x"]
        self.keyboard.press(curses.KEY_RIGHT)
        self.assertAlmostEqual(self.asked("target")[-1]["position"]["tip.x"], held + 0.001)
        self.keyboard.step = 1.0
        self.assertIn("outside control.workspace", self.keyboard.press(curses.KEY_UP))
        self.assertEqual(self.keyboard.goal, {})

    def test_keys_that_can_do_nothing_say_why(self):
        with FakeDaemon(["chamber.volume"]) as daemon, Robot(daemon.path, timeout=PATIENCE_S) as robot:
            self.assertIn("this robot has chamber.volume", Keyboard(robot, "chamber", 0.001, 0.02).press(curses.KEY_UP))
        self.daemon.phase = "enable"
        self.assertEqual(self.keyboard.press(curses.KEY_UP), "the drives do not follow yet")
        self.daemon.phase = "run"
        with Robot(self.daemon.path, timeout=PATIENCE_S) as thief:
            thief.acquire(steal=True)
            self.assertIn("acquire", self.keyboard.press(curses.KEY_UP))
            self.assertEqual(self.keyboard.press(ord("t")), "the control is yours")
        self.assertEqual(self.keyboard.press(ord("?")), "")

    def test_reset_is_asked_for_where_the_client_has_it(self):
        class Resettable:
            def reset(self):
                raise Refused("not_running", "there is no fault")

        self.assertEqual(Keyboard(Resettable(), "tip", 0.001, 0.02).press(ord("r")), "there is no fault")
        self.assertEqual(Keyboard(object(), "tip", 0.001, 0.02).press(ord("r")), "this version has no reset")

    def test_the_screen_shows_where_the_robot_is_and_what_to_do(self):
        self.daemon.faults = ["the bus is off"]
        self.daemon.more = {"fault": {"what": "the drive of north is silent", "since": 1.5, "do": "look at its cable"}}
        text = "\n".join(screen_of("fake", self.robot.status()))
        for words in ("phase run", "control: somebody", "fault: the drive of north is silent", "do: look at its cable",
                      "now: the bus is off", f"{1e3 * OFFSET_M:.2f} mm"):  # fmt: skip
            self.assertIn(words, text)
        self.daemon.phase = "enable"
        self.assertIn("phase enable", screen_of("fake", self.robot.status())[0])

    def test_the_program_runs_in_a_terminal(self):
        self.robot.release()
        master, slave = pty.openpty()
        self.addCleanup(os.close, master)
        process = self.example("keyboard.py", stdin=slave, stdout=slave, env={**os.environ, "TERM": "xterm"})
        os.close(slave)
        screen = b""

        def shows(words):
            nonlocal screen
            screen += os.read(master, 65536)
            return words in screen

        wait_until(lambda: shows(b"phase run"), "the screen")
        os.write(master, b"\x1bOC")  # right
        wait_until(lambda: shows(b"tip.x to") and self.asked("target"), "a target")
        os.write(master, b"q")
        with contextlib.suppress(OSError):  # the terminal's other side is closed
            while os.read(master, 65536):
                pass
        self.assertEqual(self.ended(process), (0, ""))


class JoystickTest(ExampleTest):
    PRESSED = EVENT.pack(1, 1, BUTTON, 4)
    RELEASED = EVENT.pack(3, 0, BUTTON, 4)

    def test_events_are_decoded(self):
        stick = Stick()
        stick.take(bytes.fromhex("78563412 0180 82 01  78563412 0100 81 03  00000000 ff7f 02 00"))
        self.assertEqual(stick.axes, {1: -1.0, 0: 1.0})
        self.assertEqual(stick.buttons, {3: True})
        stick.take(EVENT.pack(9, 0, BUTTON, 3) + EVENT.pack(9, 1000, AXIS | INITIAL, 0))
        self.assertEqual(stick.buttons, {3: False})
        self.assertEqual((stick.axis(1), stick.axis(0), stick.axis(7)), (-1.0, 0.0, 0.0))
        stick.take(EVENT.pack(9, round(0.55 * 32767), AXIS, 0))
        self.assertAlmostEqual(stick.axis(0), 0.5, places=4)

    def test_the_robot_moves_only_while_the_button_is_pressed_at_the_speed_of_the_stick(self):
        self.robot.acquire()
        stick, drive = Stick(), Drive(self.robot, {"tip.x": (0, 1), "tip.y": (1, -1)}, button=4, speed=0.03)
        stick.take(EVENT.pack(0, 32767, AXIS, 0) + EVENT.pack(0, 32767, AXIS, 1))
        drive.step(stick)
        self.assertEqual(self.asked("target"), [])
        stick.take(self.PRESSED)
        for _ in range(3):
            self.assertEqual(drive.step(stick), "")
        last = self.asked("target")[-1]
        self.assertAlmostEqual(last["position"]["tip.x"], 3 * 0.03 / RATE)
        self.assertAlmostEqual(last["position"]["tip.y"], -3 * 0.03 / RATE)
        stick.take(self.RELEASED)
        drive.step(stick)
        self.assertEqual(len(self.asked("target")), 3)
        self.assertIsNone(drive.goal)

    def test_at_the_edge_of_the_workspace_the_target_stays_and_comes_back_at_once(self):
        self.robot.acquire()
        stick, drive = Stick(), Drive(self.robot, {"tip.x": (0, 1)}, button=4, speed=0.1 * RATE)
        stick.take(EVENT.pack(0, 32767, AXIS, 0) + self.PRESSED)
        self.assertEqual(drive.step(stick), "")
        for _ in range(5):
            self.assertIn("outside control.workspace", drive.step(stick))
        stick.take(EVENT.pack(0, -32767, AXIS, 0))
        self.assertEqual(drive.step(stick), "")
        self.assertAlmostEqual(self.asked("target")[-1]["position"]["tip.x"], 0.0)

    def test_the_program_reads_a_device_until_the_daemon_ends(self):
        device = self.daemon.path.parent / "js0"
        os.mkfifo(device)
        process = self.example("joystick.py", "--device", device, stdout=subprocess.DEVNULL)
        with open(device, "wb", buffering=0) as stick:
            stick.write(EVENT.pack(0, 32767, AXIS, 0) + self.PRESSED)
            wait_until(lambda: len(self.asked("target")) > 3, "targets")
            self.daemon.end()
            code, said = self.ended(process)
        self.assertEqual(code, 1)
        self.assertRegex(said, "^joystick: the daemon .*$")
        gone = self.example("joystick.py", "--device", "/nowhere/js0")
        self.assertEqual(self.ended(gone), (1, "joystick: /nowhere/js0: No such file or directory; ls /dev/input/js* shows the devices"))


class LivePlotTest(ExampleTest):
    def setUp(self):
        try:
            import live_plot
        except ImportError:
            self.skipTest("matplotlib is not installed")
        self.live_plot = live_plot
        super().setUp()

    def test_the_last_states_are_drawn_until_the_daemon_ends(self):
        history = self.live_plot.History(self.robot, length=0.1)
        first = wait_until(lambda: history.states and history.states[0], "states")
        wait_until(lambda: history.states[0]["time"] > first["time"], "old states to be forgotten")
        figure, _ = self.live_plot.plt.subplots(2)
        self.live_plot.draw(figure, history)
        above, below = ({line.get_label(): line.get_ydata() for line in axes.lines} for axes in figure.axes)
        self.assertEqual(list(above), ["tip.x, measured", "tip.y, measured", "tip.z, measured"])
        for error in above["tip.x, measured"]:
            self.assertAlmostEqual(error, 1e3 * OFFSET_M)
        self.assertEqual(set(below["north"]), {0.001})
        self.assertLessEqual(len(history.states), 5)
        self.assertIn("fake, run", figure._suptitle.get_text())
        self.daemon.end()
        wait_until(lambda: history.ended, "the end")
        self.live_plot.draw(figure, history)
        self.assertEqual(figure._suptitle.get_text(), "the daemon has ended")

    def test_a_fault_is_in_the_title_and_before_the_run_nothing_is_drawn(self):
        self.daemon.phase = "enable"
        self.daemon.more = {"fault": {"what": "silent drive", "since": 1.5, "do": "look at its cable"}}
        history = self.live_plot.History(self.robot, length=1)
        wait_until(lambda: history.states, "states")
        self.assertEqual(self.live_plot.title_of(history), "fake, enable, none: silent drive: look at its cable")
        self.assertEqual(history.lines(), ([], {}, {}))

    def test_without_a_window_it_says_so(self):
        code, said = self.ended(self.example("live_plot.py"))
        self.assertEqual(code, 1)
        self.assertIn("there is no window", said)


if __name__ == "__main__":
    unittest.main(verbosity=2)
