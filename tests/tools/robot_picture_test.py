#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The picture of a robot shows what its file says, and can be read."""

import importlib.machinery
import importlib.util
import itertools
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
sys.dont_write_bytecode = True
try:
    from run_report import robot as document, robot_page, robot_picture
    from run_report.views import VIEWS, on_the_right, spread_out
    import matplotlib.pyplot as plt
    import matplotlib.text
    import numpy as np
except ImportError as problem:
    print(f"skipped: {problem.name} is not installed")
    sys.exit(0)

DAEMON = Path(sys.argv.pop(1))
ROBOTS = ("diamond", "finger", "bender", "trunk", "platform")
PATIENCE_S = 60 * float(os.environ.get("TENDRIL_PATIENCE", 1))  # as tests/patience.h has it


def check(*words):
    return subprocess.run([DAEMON, "--check", *words], capture_output=True, text=True, check=False, timeout=PATIENCE_S)


def handed_over(folder):
    """What tendrild hands over for each shipped robot: the program, installed beside a tool that keeps what it gets."""
    program, tool = folder / "bin/tendrild", folder / "libexec/tendril/report"
    for path in (program, tool):
        path.parent.mkdir(parents=True)
    shutil.copy(DAEMON, program)
    tool.write_text('#!/bin/sh\ncat >"$2"\nexit 1\n')  # so that the check itself does not begin
    tool.chmod(0o755)
    for robot in ROBOTS:
        kept = folder / f"{robot}.png"
        subprocess.run([program, ROOT / f"config/{robot}.yaml", "--check", "--picture", kept], capture_output=True,
                       check=False, timeout=PATIENCE_S)
        yield robot, kept.read_text()


def crowded(diamond):
    """As many actuators as there may be, all kinds of mistakes, and points far away."""
    result = json.loads(diamond)
    cable = result["actuators"][0]
    result["actuators"] = [
        {"name": f"cable-number-{k}", "kind": "cable", "points": [
            {"at_mm": [97 * np.cos(k / 5), 97 * np.sin(k / 5), 45 + k], "on_body": True}, cable["points"][1]]}
        for k in range(30)]
    result["actuators"][3]["points"][0]["misplaced"] = True
    result["actuators"][5]["points"][1] = {"at_mm": [97000, 0, 30], "on_body": False}
    result["actuators"] += [
        {"name": "thumb", "kind": "push", "points": [{"at_mm": [0, 0, 125], "on_body": True}], "direction": [0, 0, -1]},
        {"name": "air", "kind": "cavity", "faces": []}]
    result["loads"] = [{"point": {"at_mm": [97, 0, 45], "on_body": True}, "force_N": [0, 0, -0.5]}]
    result["problems"] = ["robot.yaml:25: actuators[0].cable (right): " + 30 * "much is wrong here, $x_$; "] * 9
    result["motion"]["waypoints_mm"] = [[20 * np.cos(k), 20 * np.sin(k), 125 + k] for k in range(25)]
    result["workspace_mm"] = [[-900] * 3, [900] * 3]
    return json.dumps(result)


def mixed(bender):
    """A push, a rod and loads at the border of what is shown, and a cavity that is filled and controlled."""
    result = json.loads(bender)
    result["actuators"] += [
        {"name": "thumb", "kind": "push", "points": [{"at_mm": [10, 0, -50], "on_body": True}], "direction": [-1, 0, 0]},
        {"name": "strut", "kind": "rod", "points": [{"at_mm": [0, 40, -70], "on_body": False},
                                                    {"at_mm": [0, 10, -60], "on_body": True}]}]
    result["effectors"].append({"name": "volume", "faces": result["actuators"][0]["faces"]})
    result["loads"] = [{"point": {"at_mm": [0, 0, z], "on_body": True}, "force_N": [0, 0, force]}
                       for z, force in ((0, -0.5), (-100, 0.5))]
    return json.dumps(result)


class RobotPictureTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        cls.handed = dict(handed_over(cls.folder / "usr"))
        cls.handed["mixed"] = mixed(cls.handed["bender"])
        cls.handed["crowded"] = crowded(cls.handed["diamond"])

    def figure_of(self, robot):
        figure = robot_picture.figure_of(robot)
        self.addCleanup(plt.close, figure)
        figure.canvas.draw()
        return figure

    def texts(self, figure):
        """(text, box in pixels) of every text that is seen; matplotlib has ticks beyond the ends of an axis, too."""
        beyond = set()
        for axis in itertools.chain.from_iterable((axes.xaxis, axes.yaxis) for axes in figure.axes):
            low, high = axis.get_view_interval()
            beyond |= {tick.label1 for tick in axis.get_major_ticks() if not low <= tick.get_loc() <= high}
        for text in figure.findobj(matplotlib.text.Text):
            if text.get_visible() and text.get_text().strip() and text not in beyond:
                yield text.get_text(), matplotlib.text.Text.get_window_extent(text, figure.canvas.get_renderer())

    def test_no_text_covers_another_or_leaves_the_picture(self):
        for name, handed in self.handed.items():
            figure = self.figure_of(document.read(handed, name))
            shown = list(self.texts(figure))
            self.assertGreater(len(shown), 40)
            for text, box in shown:
                with self.subTest(robot=name, text=text):
                    self.assertTrue(figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1, box)
                    self.assertTrue(figure.bbox.y0 <= box.y0 and box.y1 <= figure.bbox.y1, box)
            for (one, box), (other, beside) in itertools.combinations(shown, 2):
                across = min(box.x1, beside.x1) - max(box.x0, beside.x0)
                up = min(box.y1, beside.y1) - max(box.y0, beside.y0)
                with self.subTest(robot=name, one=one, other=other):
                    self.assertFalse(across > 1 and up > 0.3 * min(box.height, beside.height))

    def test_every_name_is_in_every_view(self):
        for name, handed in self.handed.items():
            robot = document.read(handed, name)
            axes = self.figure_of(robot).axes
            self.assertEqual(len(axes), 4)
            named = [each["name"] for each in robot.actuators + robot.effectors if each["name"] != "air"]
            for view in axes:
                said = [text.get_text().split(" (")[0] for text in view.texts]
                with self.subTest(robot=name, view=view.get_title("left")):
                    self.assertEqual([each for each in named if each not in said], [])

    def test_both_directions_have_one_scale_and_all_is_within(self):
        for name, handed in self.handed.items():
            robot = document.read(handed, name)
            for axes, view in zip(self.figure_of(robot).axes, VIEWS):
                scale = axes.transData.get_matrix()
                self.assertAlmostEqual(scale[0, 0], scale[1, 1])
                low, high = axes.viewLim.min, axes.viewLim.max
                flat = view.flat(robot.extent())
                self.assertTrue((flat > low).all() and (flat < high).all(), name)

    def test_projections_are_seen_from_the_side_that_they_are_named_after(self):
        _, front, above, right = VIEWS
        for view, towards in ((front, [0, -1, 0]), (above, [0, 0, 1]), (right, [1, 0, 0])):
            self.assertEqual(view.nearer.tolist(), towards)

    def test_kinds_of_points(self):
        trunk = document.read(self.handed["trunk"], "trunk")
        self.assertEqual(list(robot_picture.kinds_of_points(trunk.actuators[0])),
                         ["attachment", "point in the body", "pull point of a cable"])
        platform = document.read(self.handed["platform"], "platform")
        self.assertEqual(list(robot_picture.kinds_of_points(platform.actuators[0])), ["guide", "attachment"])

    def test_labels_keep_their_distance_and_their_order(self):
        heights = spread_out([50, 50, 51, 20, 0], 10, 5, 95)
        self.assertGreaterEqual(min(-np.diff(sorted(heights, reverse=True))), 10)
        self.assertEqual(np.argsort(heights).tolist(), [4, 3, 1, 0, 2])
        self.assertTrue((heights >= 5).all() and (heights <= 95).all())
        crowd = spread_out([50] * 20, 10, 5, 95)
        self.assertTrue((crowd >= 4.99).all() and (crowd <= 95.01).all())
        right = on_the_right(np.array([[x, 0] for x in (-5, -4, -3, -2, 1)]), 0, 3)
        self.assertEqual(right.tolist(), [False, False, False, True, True])

    def test_a_check_draws_the_three_formats(self):
        robot = ROOT / "config/finger.yaml"
        for ending in ("png", "svg", "html"):
            target = self.folder / f"finger.{ending}"
            ended = check(robot, "--json", "--picture", target)
            self.assertEqual(ended.returncode, 0, ended.stderr)
            self.assertEqual(json.loads(ended.stdout)["robot"], "finger")  # nothing else is printed
            self.assertEqual(ended.stderr, "")
        png = (self.folder / "finger.png").read_bytes()
        self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(struct.unpack(">II", png[16:24]), (1320, 1034))
        svg = xml.etree.ElementTree.parse(self.folder / "finger.svg")
        said = [text.text for text in svg.iter("{http://www.w3.org/2000/svg}text")]
        for name in ("left", "right", "tip (x)"):
            self.assertEqual(said.count(name), 4)
        page = (self.folder / "finger.html").read_text()
        for there in ('src="data:image/png;base64,iVBOR', "<td>right: attachment</td><td>5, 0, -90</td>"):
            self.assertTrue(there in page, there)
        self.assertFalse("http" in page)

    def test_a_robot_that_does_not_fit_its_mesh_is_drawn_and_then_refused(self):
        text = (ROOT / "config/finger.yaml").read_text().replace("finger.msh", f"{ROOT}/config/finger.msh")
        wrong = self.folder / "wrong.yaml"
        wrong.write_text(text.replace("body 5 0 -90 mm", "body 5 0 -120 mm"))
        for ending in ("svg", "html"):
            target = self.folder / f"wrong.{ending}"
            ended = check(wrong, "--picture", target)
            self.assertEqual(ended.returncode, 2)
            self.assertIn("(5, 0, -120) mm lies 20 mm outside the mesh", ended.stderr)
            line = 1 + text[:text.index("body 5 0 -90 mm")].count("\n")
            self.assertTrue(f"wrong.yaml:{line}: actuators[0].cable (right): " in target.read_text())
        self.assertEqual((self.folder / "wrong.svg").read_text().count(">(5, 0, -120)<"), 4)
        self.assertTrue("<td>5, 0, -120 (not on the body)</td>" in (self.folder / "wrong.html").read_text())

    def test_a_report_begins_with_its_robot(self):
        loader = importlib.machinery.SourceFileLoader("report", str(ROOT / "tools/report"))
        report = importlib.util.module_from_spec(importlib.util.spec_from_loader("report", loader))
        loader.exec_module(report)
        folder = self.folder / "run"
        folder.mkdir()
        self.assertEqual(report.robot_in(folder), [])  # one of an earlier version
        (folder / "robot.json").write_text(self.handed["finger"])
        ((title, _, picture),) = report.robot_in(folder)
        self.assertEqual((title, picture), ("Robot", folder / "robot.png"))
        self.assertEqual(picture.read_bytes()[:4], b"\x89PNG")
        (folder / "robot.json").write_text('{"robot": "finger"}')
        with self.assertRaisesRegex(report.ReportError, "robot.json does not describe a robot .*another version"):
            report.robot_in(folder)


if __name__ == "__main__":
    sys.exit(unittest.main())
