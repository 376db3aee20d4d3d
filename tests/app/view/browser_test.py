#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A person at the page of tendril-view, in a real browser, with a daemon and a simulated robot."""

import contextlib
import faulthandler
import re
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests/peers"), str(ROOT / "app/client"), str(Path(__file__).parent)]
import bench
from bench import PATIENCE_S, Program, finger, wait_until
from browser import CHROMIUM, Browser
from tendril import Robot

DAEMON, PLANT, VIEW, THREE, PICTURES = (sys.argv.pop(1) for _ in range(5))
if not CHROMIUM:
    bench.skip("there is no chromium; tools/setup --tests installs it")
if not Path(THREE, "stamp").exists():
    bench.skip("the page was built without three.js, since npm could not fetch it")


class BrowserTest(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory(prefix="tendril-page-", ignore_cleanup_errors=True)))
        self.socket = self.folder / "finger.sock"
        self.robot_file = self.folder / "finger.yaml"
        self.robot_file.write_text(finger())
        words = [VIEW, "--socket", self.socket, "--listen", "127.0.0.1:0"]
        self.view = self.enterContext(Program(words, self.folder / "view.log"))
        self.view.wait_for("#token=")
        self.url = re.search(r"http://\S+", self.view.said())[0]
        self.browser = self.enterContext(Browser(self.folder, (900, 600)))  # drawn by the CPU, so small

    @contextlib.contextmanager
    def running_robot(self):
        """Use with `with`: the plant and the daemon."""
        bus = f"local:{self.folder}/bus"
        with Program([PLANT, self.robot_file, "--bus", bus], self.folder / "plant.log") as plant:
            plant.wait_for("ready")
            words = [DAEMON, self.robot_file, "--bus", bus, "--allow-non-rt", "--socket", self.socket]
            with Program(words, self.folder / "daemon.log") as daemon:
                daemon.wait_for("phase: run")
                yield plant, daemon

    def wait(self, expression, what):
        """The first answer of the page that is not false."""
        return wait_until(lambda: self.browser.ask(expression), what, [self.view, self.browser])

    def shown(self, element, text):
        wait_until(lambda: text in self.browser.text(element), f"'{text}' in {element}", [self.view, self.browser])

    def test_a_person_sees_the_robot_and_moves_it(self):
        browser = self.browser
        browser.open(self.url)
        self.shown("message", "no daemon at")
        with self.running_robot() as (plant, daemon), Robot(self.socket, timeout=PATIENCE_S) as watcher:
            self.shown("phase", "run")
            self.assertEqual(browser.text("robot"), "finger")
            self.wait("page.scene?.frames > 0 && page.surfaces > 3", "the body in 3D")

            # The control, and the way of the robot by its buttons.
            browser.click("#control")
            self.shown("control", "Give control back")
            browser.click("[data-command=hold]")
            self.shown("mode", "hold")

            # A drag moves the target in the daemon, and with it the body.
            target = watcher.status()["target"]
            before = self.wait("page.positions && Array.from(page.positions)", "a surface")
            start = self.wait("""page.scene.handle.ring.visible && (() => {
                const box = page.scene.canvas.getBoundingClientRect();
                const at = page.scene.handle.ring.position.clone().project(page.scene.camera);
                return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
            })()""", "the ring")
            way = browser.ask("page.scene.pixelsPerMm() * 6")
            browser.drag(start, [start[0] + way, start[1] - 0.3 * way])
            wait_until(lambda: max(abs(value - target[name]) for name, value in watcher.status()["target"].items()) > 0.002,
                       "the target to move", [daemon])
            self.assertEqual(watcher.status()["mode"], "target")
            wait_until(lambda: max(abs(a - b) for a, b in zip(browser.ask("Array.from(page.positions)"), before)) > 2,
                       "the body to move", [daemon])
            self.shown("mode", "target")
            browser.resize(1440, 900)
            browser.screenshot(Path(PICTURES, "view.png"))

            # A fault is told in words.
            plant.write_line("fault left emcy 0x4310")
            self.shown("phase", "standby")
            self.shown("faults", "'left' (node 2): drive fault")
            browser.click("[data-command=reset]")
            self.shown("phase", "run")
            self.assertEqual(browser.text("faults"), "")
        self.shown("phase", "no daemon")

        # Another daemon is found by itself; the control is not taken back by itself.
        with self.running_robot():
            self.shown("phase", "run")
            self.shown("control", "Take control")
            self.assertEqual(browser.text("faults"), "")
            surfaces = browser.ask("page.surfaces")
            self.wait(f"page.surfaces > {surfaces} + 3", "the body again")
        self.assertEqual([each for each in browser.complaints if "WebSocket" not in each], [])

    def test_without_the_token_all_is_seen_and_nothing_can_be_pressed(self):
        with self.running_robot():
            self.browser.resize(390, 844, 2)
            self.browser.prefer("dark")
            self.browser.open(self.url.split("#")[0])
            self.wait("page.surfaces > 3", "the body")
            self.shown("control", "Watching only")
            self.assertTrue(self.browser.ask("[...document.querySelectorAll('button, #speed')].every((each) => each.disabled)"))
            self.assertLessEqual(self.browser.ask("document.documentElement.scrollWidth"), 390)
            self.browser.screenshot(Path(PICTURES, "view-phone.png"))
            self.assertEqual(self.browser.complaints, [])


if __name__ == "__main__":
    faulthandler.dump_traceback_later(5 * PATIENCE_S, exit=True)  # says where a test hangs
    unittest.main(verbosity=2)
