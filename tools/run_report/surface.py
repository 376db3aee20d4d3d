# SPDX-License-Identifier: Apache-2.0
"""A surface of triangles, shaded and translucent."""

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection

LIGHT = np.array([0.35, -0.55, 0.76])  # where it comes from, of length one
CREASE = np.cos(np.radians(35))        # edges with a sharper bend are drawn


def translucent(opacity):
    """What makes a drawn layer translucent as a whole: faces that are so one by one show where they meet."""
    def fade(image, _):
        image[..., 3] *= opacity
        return image, 0, 0
    return fade


class Surface:
    """nodes: n x 3. faces: m x 3 places among the nodes, counter-clockwise from where the normal points to."""

    def __init__(self, nodes, faces):
        self.corners = nodes[faces]
        normals = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        self.normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
        edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        face_of = np.repeat(np.arange(len(faces)), 3)
        order = np.lexsort(edges.T)
        edges, face_of = edges[order], face_of[order]
        shared = np.flatnonzero((edges[:-1] == edges[1:]).all(axis=1))
        self.edges = nodes[edges[shared]]
        self.beside = np.stack([face_of[shared], face_of[shared + 1]], axis=1)
        self.is_crease = (self.normals[self.beside[:, 0]] * self.normals[self.beside[:, 1]]).sum(axis=1) < CREASE

    def middle(self):
        return self.corners.mean(axis=(0, 1))

    def draw(self, axes, view, colour, opacity, zorder):
        """Far sides, fainter ones, at zorder, near ones above them, then the edges."""
        rgb = np.array(matplotlib.colors.to_rgb(colour))
        towards = self.normals @ view.nearer
        for near in (False, True):
            which = np.flatnonzero((towards > 0) == near)
            which = which[np.argsort(self.corners[which].mean(axis=1) @ view.nearer)]
            shade = 0.58 + 0.42 * np.clip(self.normals[which] @ LIGHT, -0.5, 1)
            colours = np.clip(1.12 * shade[:, None] * rgb, 0, 1)
            if not near:
                colours = 1 - 0.4 * opacity * (1 - colours)
            faces = LineCollection(view.flat(self.corners[which]).reshape(-1, 3, 2), colors=colours, facecolors=colours,
                                   linewidths=0.5, rasterized=True, zorder=zorder + 0.2 * near)
            if near:
                faces.set_agg_filter(translucent(opacity))
            axes.add_collection(faces, autolim=False)
        shown = self.is_crease | ((towards[self.beside[:, 0]] > 0) != (towards[self.beside[:, 1]] > 0))
        axes.add_collection(LineCollection(view.flat(self.edges[shown]).reshape(-1, 2, 2), colors=0.5 * rgb,
                                           linewidths=0.7, alpha=0.55, zorder=zorder + 0.3), autolim=False)
