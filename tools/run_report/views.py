# SPDX-License-Identifier: Apache-2.0
"""Views of things in space: directions on paper, a scale that fits, and labels that keep clear of each other."""

from collections import namedtuple

import numpy as np

FONT_PT = 8.5
LINE_PT = 12.5     # from one label to the next
LETTER_PT = 5.6    # mean width of one
MOST_LETTERS = 22  # of one label
GAP_PT = 20        # between what is shown and the labels beside it
CORNER_PT = 64     # width and height of the corners at the foot that labels leave free: gravity, and in space the axes

Label = namedtuple("Label", "text at colour ink weight")  # at: three coordinates, mm; colour: of its line


class View:
    """A direction to look in: unit vectors to the right, upwards and towards the viewer; and the axes that it shows in
    full length, if there are such."""

    def __init__(self, title, right, up, axes=None):
        self.title, self.axes = title, axes
        self.right, self.up = np.array(right, float), np.array(up, float)
        self.nearer = np.cross(self.right, self.up)

    def flat(self, points):
        """Points, n x 3, on paper: n x 2."""
        points = np.asarray(points, float).reshape(-1, 3)
        return np.stack([points @ self.right, points @ self.up], axis=1)


def oblique(title, azimuth_deg, elevation_deg):
    """The view of who stands there; azimuth counts from x to y."""
    a, e = np.radians([azimuth_deg, elevation_deg])
    return View(title, [-np.sin(a), np.cos(a), 0], [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)])


VIEWS = (oblique("In space", -58, 24), View("From the front", [1, 0, 0], [0, 0, 1], "xz"),
         View("From above", [1, 0, 0], [0, 1, 0], "xy"), View("From the right", [0, 1, 0], [0, 0, 1], "yz"))


def shortened(text, letters=MOST_LETTERS):
    return text if len(text) <= letters else text[:letters - 1] + "…"


def on_the_right(anchors, middle, most):
    """For each anchor, n x 2, whether its label stands on the right: where it is nearer, or where there are fewer. Where
    one side would have more than most, the middle ones change sides."""
    spread = np.ptp(anchors[:, 0]) if len(anchors) else 0
    result = [x > middle if abs(x - middle) > 0.02 * spread + 1e-9 else None for x in anchors[:, 0]]
    for i in np.argsort(anchors[:, 1], kind="stable"):
        if result[i] is None:
            result[i] = result.count(True) < result.count(False)
    for i in np.argsort(np.abs(anchors[:, 0] - middle), kind="stable"):
        here, there = result.count(result[i]), result.count(not result[i])
        if here > most and here > there + 1:
            result[i] = not result[i]
    return np.array(result, bool)


def spread_out(wanted, step, low, high):
    """Heights near the wanted ones, within low and high, and a step apart or as far as there is room."""
    step = min(step, (high - low) / max(len(wanted) - 1, 1))
    order = np.argsort(-np.asarray(wanted), kind="stable")
    heights = np.empty(len(wanted))
    neighbour = high + step
    for i in order:
        neighbour = heights[i] = min(wanted[i], neighbour - step)
    neighbour = low - step
    for i in order[::-1]:
        neighbour = heights[i] = max(heights[i], neighbour + step)
    return heights


class Panel:
    """Axes that show a view at one scale in both directions, with room for labels on both sides of it.

    extent: points, n x 3, that must be seen. room: around it, and to labels beside it at least. On paper, lengths are
    points of 1/72 inch.
    """

    def __init__(self, axes, view, extent, labels, room):
        self.axes, self.view = axes, view
        box = axes.get_window_extent()
        self.size = np.array([box.width, box.height]) * 72 / axes.figure.dpi
        flat = view.flat(extent)
        low, high = flat.min(axis=0), flat.max(axis=0)
        self.labels = [label._replace(text=shortened(label.text)) for label in labels]
        self.anchors = view.flat([label.at for label in labels])
        self.right = on_the_right(self.anchors, (low[0] + high[0]) / 2, (self.size[1] - CORNER_PT) // LINE_PT)
        gap = max(GAP_PT, room)
        widths = np.array([LETTER_PT * len(label.text) for label in self.labels])
        beside = np.array([widths[side].max() + gap if side.any() else 0 for side in (~self.right, self.right)])
        left = self.size - 2 * room - [beside.sum(), 0]
        self.pt_per_mm = min(left / np.maximum(high - low, 1e-6))
        self.origin = (low + high) / 2 - (self.size / 2 + [(beside[0] - beside[1]) / 2, 0]) / self.pt_per_mm
        self.columns = (low[0] - self.origin[0]) * self.pt_per_mm - gap, \
            (high[0] - self.origin[0]) * self.pt_per_mm + gap
        end = self.origin + self.size / self.pt_per_mm
        axes.set(xlim=(self.origin[0], end[0]), ylim=(self.origin[1], end[1]))

    def on_paper(self, positions):
        """Positions in space, n x 3, from the panel's lower left corner."""
        return (self.view.flat(positions) - self.origin) * self.pt_per_mm

    def points(self, positions, **style):
        self.line(positions, linestyle="none", **style)

    def line(self, positions, **style):
        self.axes.plot(*self.view.flat(positions).T, **style)

    def text(self, place, text, **style):
        """A text at a place on paper."""
        return self.axes.text(*(place / self.size), text, transform=self.axes.transAxes, **style)

    def arrow(self, begin, direction, length, colour):
        """An arrow from a place on paper, as long as the view shows it; one along the view is a ring with a dot, towards
        the viewer, or with a cross. Returns its end."""
        direction = np.array(direction, float) / np.linalg.norm(direction)
        end = begin + length * self.view.flat(direction)[0]
        if np.linalg.norm(end - begin) < 0.15 * length:
            at = begin / self.size
            towards = direction @ self.view.nearer > 0
            for style in ({"marker": "o", "ms": 9, "mfc": "white", "mew": 1.3},
                          {"marker": "." if towards else "x", "ms": 5}):
                self.axes.plot(*at, color=colour, transform=self.axes.transAxes, zorder=8, **style)
            return begin
        self.axes.annotate("", end / self.size, begin / self.size, "axes fraction", zorder=8,
                           arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.8, "shrinkA": 0, "shrinkB": 0})
        return end

    def write_labels(self):
        """Writes the labels left and right of what is shown, each with a line to what it is about."""
        for side, column in zip((False, True), self.columns):
            which = np.flatnonzero(self.right == side)
            if not len(which):
                continue
            width = LETTER_PT * max(len(self.labels[i].text) for i in which)
            in_corner = column + width > self.size[0] - CORNER_PT if side else \
                not self.view.axes and column - width < CORNER_PT
            low = LINE_PT / 2 + (CORNER_PT if in_corner else 0)
            high = self.size[1] - LINE_PT / 2
            wanted = [(self.anchors[i, 1] - self.origin[1]) * self.pt_per_mm for i in which]
            size = FONT_PT * min(1, (high - low) / (len(which) * LINE_PT))
            for i, height in zip(which, spread_out(wanted, LINE_PT, low, high)):
                label = self.labels[i]
                self.axes.annotate(
                    label.text, self.anchors[i], (column, height) / self.size, textcoords="axes fraction",
                    ha="left" if side else "right", va="center", fontsize=size, weight=label.weight,
                    color=label.ink, zorder=10,
                    arrowprops={"arrowstyle": "-", "color": label.colour, "lw": 0.9, "shrinkA": 1, "shrinkB": 0,
                                "relpos": (0, 0.5) if side else (1, 0.5)})
