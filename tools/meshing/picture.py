# SPDX-License-Identifier: Apache-2.0
"""The picture of a mesh: the body cut open, and how its tetrahedra are shaped."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LightSource
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from .tets import boundary, dihedral_angles, qualities

SLIVER = 0.1  # fem/mesh/mesh_quality.h warns below this mean ratio
BLUE, RED = "#0072B2", "#D55E00"


def draw(path, title, points, tets, unit):
    figure = plt.figure(figsize=(11, 5), dpi=110, layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=[1.3, 1])
    quality = qualities(points, tets)
    draw_body(figure.add_subplot(grid[:, 0], projection="3d"), points, tets, quality, unit)
    ratio, angle = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
    ratio.hist(quality, bins=np.linspace(0, 1, 51), color=BLUE)
    ratio.axvline(SLIVER, color=RED, linestyle="--", label="sliver")
    ratio.set(xlabel="mean ratio (1: regular)", ylabel="tetrahedra", xlim=(0, 1))
    ratio.legend(frameon=False)
    angle.hist(dihedral_angles(points, tets).ravel(), bins=np.linspace(0, 180, 61), color=BLUE)
    angle.axvline(np.degrees(np.arccos(1 / 3)), color="black", linestyle=":", label="regular")
    angle.set(xlabel="dihedral angle (°)", ylabel="edges of tetrahedra", xlim=(0, 180))
    angle.legend(frameon=False)
    figure.suptitle(f"{title}: {len(points)} nodes, {len(tets)} tetrahedra", fontweight="bold")
    figure.savefig(path)
    plt.close(figure)


def draw_body(axes, points, tets, quality, unit):
    """The half of the body behind its middle, so that cavities show; the colour is the mean ratio."""
    middle = (points[:, 1].min() + points[:, 1].max()) / 2
    kept = points[tets].mean(axis=1)[:, 1] >= middle
    faces, owner = boundary(tets[kept], with_owner=True)
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    light = LightSource(azdeg=250, altdeg=40)
    shade = 0.55 + 0.45 * np.clip(normals @ light.direction, 0, 1)
    colours = plt.get_cmap("viridis")(quality[kept][owner])
    colours[:, :3] *= shade[:, None]
    axes.add_collection3d(Poly3DCollection(corners, facecolors=colours, edgecolors=(0, 0, 0, 0.25), linewidths=0.3))
    lower, upper = points.min(axis=0), points.max(axis=0)
    axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]), zlim=(lower[2], upper[2]),
             xlabel=f"x ({unit})", ylabel=f"y ({unit})", zlabel=f"z ({unit})")
    axes.set_box_aspect(upper - lower)
    axes.locator_params(nbins=4)
    axes.view_init(elev=20, azim=-70)
    bar = axes.figure.colorbar(plt.cm.ScalarMappable(cmap="viridis"), ax=axes, shrink=0.6, location="left")
    bar.set_label("mean ratio, cut open at the middle of y")
