#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Includes form a tree of rooms, and no circle anywhere. A unit is a header with its source, or either alone."""

import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("app", "fem", "hal", "qp", "rt", "tools")
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)


def sources(root=ROOT):
    return [file for folder in FOLDERS for file in sorted((root / folder).rglob("*")) if file.suffix in (".h", ".cpp")]


def included(root=ROOT):
    """Of each unit those that it includes, by their paths from the root without extension."""
    graph = {}
    for file in sources(root):
        unit = file.relative_to(root).with_suffix("").as_posix()
        names = {Path(name).with_suffix("").as_posix() for name in INCLUDE.findall(file.read_text())}
        graph.setdefault(unit, set()).update(names - {unit})
    return graph


def rooms(graph):
    """The same graph of the folders that the units lie in."""
    folders = {}
    for unit, names in graph.items():
        room = str(Path(unit).parent)
        folders.setdefault(room, set()).update({str(Path(name).parent) for name in names} - {room})
    return folders


def reaches_simulated(graph):
    """Units of hal/ and rt/ that include a simulated one although they are neither simulated nor make simulated drives.

    Simulated is what lies in hal/sim or has a name that begins with simulated_. The file that makes them, one for
    each protocol, has the name of its folder and _protocol.
    """
    def simulated(unit):
        return unit.startswith("hal/sim/") or Path(unit).name.startswith("simulated_")

    def makes_drives(unit):
        path = Path(unit)
        return path.name == f"{path.parent.name}_protocol" and unit != "hal/drive/drive_protocol"

    return sorted(unit for unit, names in graph.items()
                  if unit.startswith(("hal/", "rt/")) and not simulated(unit) and not makes_drives(unit)
                  and any(simulated(name) for name in names))


def circle(graph):
    """The nodes of one circle, in order; none where there is no circle."""
    done = set()

    def search(node, way):
        if node in way:
            return way[way.index(node):] + [node]
        if node in done:
            return None
        for following in sorted(graph.get(node, ())):
            if found := search(following, way + [node]):
                return found
        done.add(node)
        return None

    for node in sorted(graph):
        if found := search(node, []):
            return found
    return None


class IncludesTest(unittest.TestCase):
    def test_units_include_each_other_in_no_circle(self):
        self.assertIsNone(circle(included()))

    def test_rooms_include_each_other_in_no_circle(self):
        self.assertIsNone(circle(rooms(included())))

    def test_every_include_in_quotes_is_written_from_the_root(self):
        for file in sources():
            for name in INCLUDE.findall(file.read_text()):
                with self.subTest(file=file.relative_to(ROOT).as_posix(), include=name):
                    self.assertTrue((ROOT / name).is_file())
                    self.assertNotIn("..", name)

    def test_the_controllers_side_includes_no_simulated_drive(self):
        self.assertEqual(reaches_simulated(included()), [])

    def test_every_file_of_hal_sim_has_a_name_that_says_simulated(self):
        for file in sources():
            if file.parent == ROOT / "hal/sim":
                self.assertTrue(file.name.startswith("simulated_"), file.name)

    def test_an_include_of_a_simulated_drive_is_found(self):
        simulated = "hal/odrive/simulated_odrive_drive"
        self.assertEqual(reaches_simulated({
            simulated: {"hal/sim/simulated_servo"}, "hal/odrive/odrive_protocol": {simulated},
            "hal/odrive/odrive_axis": {simulated}, "hal/drive/drive_protocol": {"hal/sim/simulated_drive"},
            "rt/controller": {"hal/drive/drives"}}), ["hal/drive/drive_protocol", "hal/odrive/odrive_axis"])

    def test_a_circle_is_found(self):
        self.assertEqual(circle({"a": {"b"}, "b": {"c"}, "c": {"b"}}), ["b", "c", "b"])


if __name__ == "__main__":
    unittest.main()
