# SPDX-License-Identifier: Apache-2.0
"""The robot as its file describes it: one picture of four views."""

import textwrap

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from .pictures import GREY
from .robot import INK, WRONG
from .run import count
from .views import FONT_PT, VIEWS, Panel, shortened

TITLE = "Robot"
CAPTION = ("The robot as its file describes it, in the shape of the mesh. A cable runs from its attachment through its "
           "points to the pull point, where it leaves for the winch. A cross in a ring is an arrow away from you.")
SIZE_IN = (12, 9.4)
PATH, BODY, FIXED = "#6A3D9A", "#B4C3D1", "#5B4A3A"
ARROW_PT = 30
LETTERS = 175       # in a line across the picture
MOST_LINES = 6      # of problems
MOST_NUMBERS = 12   # of waypoints that have a number
HALO = [withStroke(linewidth=2.5, foreground="white")]
WORKSPACE = {"color": GREY, "lw": 0.9, "ls": (0, (4, 3))}

# How a kind of point looks, in the colour of its actuator; what is not filled is white inside.
MARKS = {"attachment": ("o", 6, True), "point in the body": ("o", 5, False), "guide": ("s", 5, False),
         "pull point of a cable": ("D", 6, False)}


def mark(kind, colour):
    marker, size, filled = MARKS[kind]
    return {"marker": marker, "ms": size, "mec": colour, "mew": 1.3, "mfc": colour if filled else "white", "zorder": 6}


def kinds_of_points(actuator):
    """For each point of a cable or rod its kind, a key of MARKS."""
    points, is_cable = actuator["points"], actuator["kind"] == "cable"
    for i, point in enumerate(points):
        if is_cable and i == len(points) - 1:
            yield "pull point of a cable"
        elif not point["on_body"]:
            yield "guide"
        else:
            yield "point in the body" if is_cable and i > 0 else "attachment"


def draw_actuator(panel, robot, actuator):
    colour, places = robot.colours[actuator["name"]], robot.places(actuator)
    if actuator["kind"] == "push":
        push(panel, places[0], actuator["direction"], colour)
    elif actuator["kind"] == "cavity":
        if actuator["name"] in robot.walls:
            robot.walls[actuator["name"]].draw(panel.axes, panel.view, colour, 0.42, zorder=2.1)
    else:
        width = 1.9 if actuator["kind"] == "cable" else 4
        panel.line(places, color="white", lw=width + 1.8, zorder=4, solid_capstyle="round")
        panel.line(places, color=colour, lw=width, zorder=5, solid_capstyle="round")
        for place, kind in zip(places, kinds_of_points(actuator)):
            panel.points(place, **mark(kind, colour))


def push(panel, place, direction, colour):
    """An arrow that ends where it pushes."""
    flat = panel.view.flat(direction)[0] / np.linalg.norm(direction)
    panel.arrow(panel.on_paper(place)[0] - ARROW_PT * flat, direction, ARROW_PT, colour)


def draw_effector(panel, robot, effector):
    is_filled = any(actuator.get("faces") == effector.get("faces") for actuator in robot.actuators)
    if effector["name"] in robot.walls and not is_filled:  # else it has the colour of its actuator
        robot.walls[effector["name"]].draw(panel.axes, panel.view, GREY, 0.3, zorder=2.1)
    places = robot.places(effector)
    for place in places if len(places) > 1 else ():
        panel.line([place, places.mean(axis=0)], color=INK, lw=0.8, ls=":", zorder=6.8)
    panel.points(places, marker="*", ms=10, color=INK, mec="white", mew=0.6, zorder=7)


def draw_motion(panel, robot):
    panel.line(robot.path, color=PATH, lw=1.3, marker="o", ms=3, zorder=6.5)
    panel.points(robot.origin, color=PATH, marker="+", ms=8, mew=1.3, zorder=6.6)
    places = panel.on_paper(robot.waypoints)
    texts = []  # (place, numbers): waypoints that are seen at one place share a text
    for k in range(len(places) if len(places) <= MOST_NUMBERS else 1):
        shared = [numbers for place, numbers in texts if np.linalg.norm(place - places[k]) < 8]
        if shared:
            shared[0].append(str(k))
        else:
            texts.append((places[k], [str(k)]))
    middle = places.mean(axis=0)
    for place, numbers in texts:
        across, up = (place - middle) / max(np.linalg.norm(place - middle), 1e-9)
        if abs(up) < 0.3:  # beside it are the lines of labels
            up = 0.7
        panel.text(place + np.array([4 * np.sign(across), 6 * np.sign(up)]), ", ".join(numbers), fontsize=7.5,
                   color=PATH, weight="bold", va="center", path_effects=HALO, zorder=9,
                   ha="center" if abs(across) < 0.3 else "left" if across > 0 else "right")


def draw_workspace(panel, corners):
    edges = [(i, i | bit) for i in range(len(corners)) for bit in (1, 2, 4) if not i & bit]
    gap = np.full(3, np.nan)
    panel.line([place for i, k in edges for place in (corners[i], corners[k], gap)], zorder=3, **WORKSPACE)


def draw_corners(panel, gravity):
    """Gravity at the foot on the right; in space the axes on the left."""
    if np.linalg.norm(gravity) > 0:
        middle = np.array([panel.size[0] - 30, 38])
        push_from = middle - ARROW_PT / 2 * panel.view.flat(gravity)[0] / np.linalg.norm(gravity)
        panel.arrow(push_from, gravity, ARROW_PT, INK)
        panel.text(np.array([middle[0], 9]), "gravity", fontsize=8, ha="center", va="center")
    for name, axis in zip("xyz", np.eye(3)) if not panel.view.axes else ():
        begin, flat = np.array([26, 18]), panel.view.flat(axis)[0]
        end = panel.arrow(begin, axis, ARROW_PT, GREY)
        panel.text(end + 7 * flat / np.linalg.norm(flat), name, fontsize=9, ha="center", va="center")


def draw_view(axes, view, robot):
    has_arrows = robot.loads or any(actuator["kind"] == "push" for actuator in robot.actuators)
    panel = Panel(axes, view, robot.extent(), robot.labels(), room=ARROW_PT + 4 if has_arrows else 16)
    robot.body.draw(axes, view, BODY, 0.42, zorder=2)
    panel.points(robot.fixed, color=FIXED, marker="s", ms=2.4, mew=0, zorder=3)
    draw_workspace(panel, robot.workspace)
    for actuator in robot.actuators:
        draw_actuator(panel, robot, actuator)
    for effector in robot.effectors:
        draw_effector(panel, robot, effector)
    for load in robot.loads:
        if any(load["force_N"]):
            push(panel, robot.places(load)[0], load["force_N"], GREY)
    if len(robot.path):
        draw_motion(panel, robot)
    for point in robot.wrong_points():
        panel.points(robot.near(point["at_mm"]), marker="x", ms=10, color=WRONG, mew=2.4, zorder=9)
    draw_corners(panel, robot.gravity)
    panel.write_labels()
    axes.set_title(view.title + (f": {view.axes[0]} and {view.axes[1]}, mm" if view.axes else ""))
    axes.tick_params(labelsize=8, color="#CCCCCC")
    axes.grid(bool(view.axes))
    if not view.axes:
        axes.set(xticks=[], yticks=[])
    axes.spines[:].set_visible(True)
    axes.spines[:].set_color("#CCCCCC")


def legend(robot):
    """What the marks mean, of those that occur."""
    kinds = {kind for actuator in robot.actuators if actuator["kind"] in ("cable", "rod")
             for kind in kinds_of_points(actuator)}
    handles = [Line2D([], [], linestyle="none", label=kind, **mark(kind, INK)) for kind in MARKS if kind in kinds]
    for occurs, label, style in (
            (len(robot.fixed), "fixed nodes", {"ls": "none", "marker": "s", "ms": 4, "color": FIXED}),
            (True, "effector (coordinates)", {"ls": "none", "marker": "*", "ms": 10, "color": INK}),
            (len(robot.path), "path and waypoints", {"color": PATH, "marker": "o", "ms": 3}),
            (len(robot.origin), "origin of the waypoints", {"ls": "none", "marker": "+", "ms": 8, "color": PATH}),
            (len(robot.workspace), "workspace", WORKSPACE),
            (robot.wrong_points(), "not on the body, or far away",
             {"ls": "none", "marker": "x", "ms": 8, "mew": 2.4, "color": WRONG})):
        if occurs:
            handles.append(Line2D([], [], label=label, **style))
    return handles


def lines_of_problems(robot):
    lines = []
    for k, text in enumerate(robot.problems):
        wrapped = textwrap.wrap(text, LETTERS, subsequent_indent="    ")
        if len(lines) + len(wrapped) > MOST_LINES:
            return lines + [f"and {len(robot.problems) - k} more"]
        lines += wrapped
    return lines


def figure_of(robot):
    """The picture. To be closed by whoever takes it."""
    width, height = SIZE_IN
    figure = plt.figure(figsize=SIZE_IN, layout="none")
    left, line = 0.5 / width, 1 - 0.3 / height
    title = figure.text(left, line, shortened(robot.name, 40), fontsize=15, weight="bold")
    beside = title.get_window_extent(figure.canvas.get_renderer()).x1 / figure.bbox.width + 0.01
    size = " × ".join(f"{x:.4g}" for x in robot.size)
    figure.text(beside, line, f"{size} mm, {count(robot.node_count)} nodes, in the shape of the mesh", fontsize=10,
                color="#555555")
    told = lines_of_problems(robot)
    for k, text in enumerate(told):
        figure.text(left, line - (0.25 + 0.19 * k) / height, text, fontsize=9, color=WRONG, parse_math=False)
    grid = figure.add_gridspec(2, 2, left=left, right=1 - 0.25 / width, top=1 - (0.72 + 0.19 * len(told)) / height,
                               bottom=0.85 / height, wspace=0.09, hspace=0.16)
    for place, view in zip(grid, VIEWS):
        draw_view(figure.add_subplot(place), view, robot)
    figure.legend(handles=legend(robot), loc="lower center", ncol=5, fontsize=FONT_PT + 0.5)
    return figure


def draw(robot, target):
    """Writes the picture into a file, in the format that its name ends in, or as PNG into an object like a file."""
    with plt.rc_context({"svg.fonttype": "none"}):
        figure = figure_of(robot)
        figure.savefig(target)
        plt.close(figure)
