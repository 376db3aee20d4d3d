# SPDX-License-Identifier: Apache-2.0
"""What a robot file describes, as tendrild hands it over: app/robot/robot_geometry.h says what is in it."""

import json

import numpy as np

from .pictures import GREY, colours_of
from .run import ReportError
from .surface import Surface
from .views import Label

FILE = "robot.json"
INK, WRONG = "#1A1A1A", "#D00000"
FAR = 0.6  # of the body's diagonal: what is farther from the body is shown on its way there


def read(text, where):
    """The document. Raises a ReportError where it is none."""
    try:
        return Robot(json.loads(text))
    except (KeyError, TypeError, ValueError) as error:
        raise ReportError(f"{where} does not describe a robot ({error!r}); was it written by another version of "
                          "tendrild?") from None


def midway(points):
    """The point halfway along a line of points, n x 3."""
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.array([np.interp(along[-1] / 2, along, points[:, axis]) for axis in range(3)])


class Robot:
    """The document's parts, with arrays for lists. Lengths are mm."""

    def __init__(self, document):
        self.name, self.size, self.node_count = document["robot"], document["size_mm"], document["nodes"]
        self.actuators, self.effectors, self.loads = (document[key] for key in ("actuators", "effectors", "loads"))
        self.gravity, self.problems = np.array(document["gravity_m_per_s2"]), document["problems"]
        self.fixed = np.array(document["fixed_mm"], float).reshape(-1, 3)
        self.colours = dict(zip([a["name"] for a in self.actuators], colours_of(len(self.actuators))))
        self._nodes = np.array(document["surface"]["nodes_mm"], float)
        self._low, self._high = self._nodes.min(axis=0), self._nodes.max(axis=0)
        self._read_surfaces(document["surface"]["faces"])
        self._read_workspace(document["workspace_mm"])
        self._read_motion(document["motion"])

    def _read_surfaces(self, faces):
        walls = {each["name"]: each["faces"] for each in self.actuators + self.effectors if each.get("faces")}
        self.walls = {name: Surface(self._nodes, np.array(wall)) for name, wall in walls.items()}
        inside = {tuple(sorted(face)) for wall in walls.values() for face in wall}
        self.body = Surface(self._nodes, np.array([face for face in faces if tuple(sorted(face)) not in inside]))

    def _read_workspace(self, box):
        """Its eight corners; none where it is so large that it would say nothing."""
        self.workspace = np.empty((0, 3))
        if box and not any(self.is_far(corner) for corner in box):
            self.workspace = np.array([[box[i][0], box[j][1], box[k][2]]
                                       for k in (0, 1) for j in (0, 1) for i in (0, 1)], float)

    def _read_motion(self, motion):
        """Waypoints, and the line through them; none of either where the file has no motion."""
        self.waypoints = self.path = self.origin = np.empty((0, 3))
        if motion:
            self.waypoints = np.array([self.near(waypoint) for waypoint in motion["waypoints_mm"]])
            self.path = np.concatenate([self.waypoints, self.waypoints[:1]]) if motion["closed"] else self.waypoints
            self.origin = self.near(motion["origin_mm"])[None]

    def is_far(self, point):
        return np.linalg.norm(point - np.clip(point, self._low, self._high)) > FAR * np.linalg.norm(
            self._high - self._low)

    def near(self, point):
        """Where a point is shown."""
        point, middle = np.array(point, float), (self._low + self._high) / 2
        if self.is_far(point):
            point = middle + FAR * np.linalg.norm(self._high - self._low) * (point - middle) / np.linalg.norm(
                point - middle)
        return point

    def places(self, each):
        """Where the points of an actuator, effector or load are shown, n x 3."""
        points = each.get("points", [each["point"]] if "point" in each else [])
        return np.array([self.near(point["at_mm"]) for point in points]).reshape(-1, 3)

    def wrong_points(self):
        """Points that are not on the body though they should be, or far away from it."""
        everything = self.actuators + self.effectors + [{"points": [load["point"]]} for load in self.loads]
        return [point for each in everything for point in each.get("points", [])
                if point.get("misplaced") or self.is_far(point["at_mm"])]

    def extent(self):
        """Points that must be seen, n x 3."""
        return np.concatenate([self._nodes, self.workspace, self.path, self.origin]
                              + [self.places(each) for each in self.actuators + self.effectors + self.loads])

    def labels(self):
        """Names, each at the middle of what has it."""
        result = []
        for actuator in self.actuators:
            if actuator["name"] in self.walls or actuator.get("points"):
                result.append(Label(actuator["name"], self._middle(actuator), self.colours[actuator["name"]], INK,
                                    "normal"))
        for effector in self.effectors:
            if effector["name"] in self.walls or effector.get("points"):
                what = " ".join(effector.get("coordinates", ["volume"]))
                result.append(Label(f"{effector['name']} ({what})", self._middle(effector), INK, INK, "bold"))
        for load in self.loads:
            size = f"load {np.linalg.norm(load['force_N']):.3g} N"
            result.append(Label(size, self.places(load)[0], GREY, INK, "normal"))
        for point in self.wrong_points():
            text = f"({', '.join(f'{x:.6g}' for x in point['at_mm'])})"
            result.append(Label(text, self.near(point["at_mm"]), WRONG, WRONG, "bold"))
        return result

    def _middle(self, each):
        if each["name"] in self.walls:
            return self.walls[each["name"]].middle()
        places = self.places(each)
        return places.mean(axis=0) if "coordinates" in each else midway(places)
