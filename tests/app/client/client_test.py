#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The Python client against a daemon that is fast, slow, silent, gone or none at all."""

import contextlib
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

from fake_daemon import PATIENCE_S, ROOT, FakeDaemon, wait_until
from tendril import ControlLost, Refused, Robot


class ClientTest(unittest.TestCase):
    def setUp(self):
        self.daemon = self.enterContext(FakeDaemon())
        self.robot = self.enterContext(Robot(self.daemon.path, timeout=PATIENCE_S))

    def targets(self):
        return [request for request in self.daemon.requests if request["command"] == "target"]

    def test_go_to_returns_when_the_target_is_there(self):
        self.robot.acquire()
        state = self.robot.go_to({"tip.x": 0.01}, within=0.1)
        self.assertEqual(state["target"]["tip.x"], 0.01)
        self.assertEqual(self.daemon.requests[-1], self.daemon.requests[-1] | {"command": "subscribe", "rate": 0})

    def test_go_to_says_why_the_robot_stops_on_the_way(self):
        self.robot.acquire()
        self.daemon.faults = ["the bus is off"]

        def stop():
            wait_until(self.targets, "the target")
            self.daemon.phase = "stop"

        thread = threading.Thread(target=stop)
        thread.start()
        with self.assertRaisesRegex(Refused, "the robot stops; the bus is off"):
            self.robot.go_to({"tip.x": 0.01}, within=600)
        thread.join()

    def test_a_stream_that_is_late_is_put_off_and_loses_nothing(self):
        self.robot.acquire()
        rate = 20

        def positions():
            for k in range(8):
                if k == 4:
                    time.sleep(3.5 / rate)
                yield {"tip.x": 0.001 * k}

        put_off = self.robot.stream(positions(), rate)
        self.assertGreater(put_off, 1.5 / rate)
        self.assertEqual([target["position"]["tip.x"] for target in self.targets()], [0.001 * k for k in range(8)])
        for target in self.targets():  # never faster than twice the speed of the positions
            self.assertGreaterEqual(target["in"], 1 / rate)
            self.assertLessEqual(target["in"], 2 / rate)

    def test_states_may_come_more_seldom_than_answers_must(self):
        class Spy(Robot):
            def _next(self):
                self.patience = self._socket.gettimeout()
                return super()._next()

        robot = self.enterContext(Spy(self.daemon.path, timeout=PATIENCE_S))
        with contextlib.closing(robot.states(rate=0.01)) as states:
            next(states)
        self.assertEqual(robot.patience, PATIENCE_S + 100)
        self.assertEqual(robot._socket.gettimeout(), PATIENCE_S)
        with self.assertRaises(ValueError):
            next(robot.states(rate=0))

    def test_the_loss_of_the_control_is_told_and_a_refusal_has_its_code(self):
        self.robot.acquire()
        other = self.enterContext(Robot(self.daemon.path, timeout=PATIENCE_S))
        with self.assertRaises(Refused) as refusal:
            other.acquire()
        self.assertEqual(refusal.exception.code, "control_taken")
        other.acquire(steal=True)
        with self.assertRaisesRegex(ControlLost, "a thief has taken the control"):
            for _ in self.robot.states(rate=100):
                pass

    def test_a_daemon_that_is_silent_gives_a_connection_error(self):
        self.daemon.silent = True
        self.robot._socket.settimeout(0.05)
        with self.assertRaisesRegex(ConnectionError, "no answer for 0.05 s"):
            self.robot.status()
        with self.assertRaisesRegex(ConnectionError, "the connection is closed"):
            self.robot.status()

    def test_a_daemon_that_ends_gives_a_connection_error_and_a_new_one_a_new_connection(self):
        other = self.enterContext(Robot(self.daemon.path, timeout=PATIENCE_S))
        states = other.states(rate=100)
        next(states)
        with self.assertRaisesRegex(ConnectionError, "the daemon has ended"):
            for _ in self.robot.states(rate=100):
                self.daemon.end()
        states.close()  # has nothing to tell any more
        with self.assertRaises(ConnectionError):
            self.robot.status()
        with self.assertRaisesRegex(ConnectionError, "no daemon at .*fake.sock: No such file"):
            Robot(self.daemon.path)
        after = self.enterContext(FakeDaemon())
        self.assertEqual(self.enterContext(Robot(after.path, timeout=PATIENCE_S)).name, "fake")

    def test_whoever_is_no_daemon_is_told(self):
        for words in (b"220 mail ready\n", b'{"version":2}\n', b"[]\n", b"\xff\xfe\n", b"", b'{"half'):
            with self.subTest(words), tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as server:
                server.bind(f"{folder}/s")
                server.listen()

                def speak(server=server, words=words):
                    with contextlib.closing(server.accept()[0]) as client:
                        client.sendall(words)

                thread = threading.Thread(target=speak)
                thread.start()
                with self.assertRaisesRegex(ConnectionError, f"no daemon at {folder}/s"):
                    Robot(f"{folder}/s", timeout=PATIENCE_S)
                thread.join()


class TypesTest(unittest.TestCase):
    def test_the_types_of_client_and_examples_are_complete_and_right(self):
        words = [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", "--cache-dir", "/dev/null"]
        files = [ROOT / "app/client/tendril.py", *sorted((ROOT / "app/client/examples").glob("*.py"))]
        ended = subprocess.run([*words, *files], capture_output=True, text=True, check=False)
        if "No module named mypy" in ended.stderr:
            self.skipTest("mypy is not installed")
        self.assertEqual(ended.returncode, 0, ended.stdout)

    def test_nothing_is_needed_that_python_lacks(self):
        text = (ROOT / "app/client/tendril.py").read_text()
        modules = {line.split()[1].partition(".")[0] for line in text.splitlines() if line.startswith(("import ", "from "))}
        self.assertLessEqual(modules, set(sys.stdlib_module_names))


if __name__ == "__main__":
    unittest.main(verbosity=2)
