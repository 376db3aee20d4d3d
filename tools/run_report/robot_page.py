# SPDX-License-Identifier: Apache-2.0
"""One self-contained page with the picture of a robot."""

import base64
import io
from html import escape

from .page import STYLE, table
from .robot_picture import CAPTION, draw, kinds_of_points


def coordinates(point):
    said = ", ".join(f"{x:.6g}" for x in point["at_mm"])
    return said + (" (not on the body)" if point.get("misplaced") else "")


def points(robot):
    """(what, coordinates) of every point that the file gives."""
    for actuator in robot.actuators:
        kinds = kinds_of_points(actuator) if actuator["kind"] in ("cable", "rod") else ("attachment",)
        for kind, point in zip(kinds, actuator.get("points", [])):
            yield f"{actuator['name']}: {kind}", coordinates(point)
    for effector in robot.effectors:
        for point in effector.get("points", []):
            yield f"{effector['name']}: point", coordinates(point)


def write(robot, target):
    """Writes the page into the file target."""
    picture = io.BytesIO()
    draw(robot, picture)
    problems = "".join(f"{escape(problem)}<br>" for problem in robot.problems)
    fault = f'<div class="verdict fault"><b>This does not fit the mesh.</b><br>{problems}</div>' if problems else ""
    target.write_text(
        f'<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>Tendril: {escape(robot.name)}</title><style>{STYLE}</style><h1>The robot {escape(robot.name)}</h1>{fault}"
        f'<figure><img alt="The robot" src="data:image/png;base64,{base64.b64encode(picture.getvalue()).decode()}">'
        f'<figcaption>{escape(CAPTION)}</figcaption></figure><div class="tables">{table("Points, mm", points(robot))}</div>'
        f"</html>\n", encoding="utf-8")
