# SPDX-License-Identifier: Apache-2.0
"""Whether a triangulated surface encloses a body."""

import numpy as np

WELD = 1e-6  # corners closer than this share of the surface's size are one
MOST_PAIRS = 4_000_000  # of triangles compared at once, to bound the memory


class SurfaceError(Exception):
    """What is wrong with a surface, where, and what to do about it."""


def place(p):
    return f"({p[0]:.4g}, {p[1]:.4g}, {p[2]:.4g})"


def check_closed(points, triangles, hint=""):
    """Refuses a surface with an edge of one triangle, or of more than two: where these are an even number, parts of the
    body hang together by the edge, each closed by itself."""
    edges = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    repair = "; repair it in the program that drew it, in MeshLab (Close Holes) or in Blender (3D Print Toolbox)" + hint
    unite = (": there they hang together by an edge and can turn, or touch in a face that is still in between; let them "
             "overlap, and unite them in the program that drew them (a Boolean union)")
    for wrong, what, remedy in (
            (count == 1, "the surface is not closed: {} edges have a triangle on one side only", repair),
            (count % 2 == 1, "the surface crosses itself: {} edges have more than two triangles", repair),
            (count > 2, "parts of the body meet at edges: {} have four triangles or more", unite)):
        if wrong.any():
            middles = points[edges[wrong]].mean(axis=1)
            raise SurfaceError(f"{what.format(wrong.sum())}, the first at {place(middles[0])}{remedy}")


def check_does_not_cross_itself(points, triangles):
    """Refuses a surface of which an edge goes through a triangle by more than the file's rounding.

    Files round coordinates, so triangles of a plane do not lie in one exactly, and thin ones may fold over: that is no
    crossing. A depth far above the rounding of numbers here makes the outcome independent of it."""
    size = np.linalg.norm(np.ptp(points, axis=0))
    depth = 2 * WELD * size + 2.0**-21 * np.abs(points).max()  # corners were welded, then rounded as floats of 32 bits
    triangles = triangles[np.argsort(points[triangles, 0].min(axis=1))]
    corners = points[triangles]
    normals, flat = planes(corners, depth)
    for a, b in near_pairs(corners):
        apart = (triangles[a][:, :, None] == triangles[b][:, None, :]).sum(axis=(1, 2)) < 2
        for one, other in ((a[apart], b[apart]), (b[apart], a[apart])):
            heights = np.einsum("ikj,ij->ik", corners[one] - corners[other, None, 0], normals[other])
            both_sides = (heights.min(axis=1) < -depth) & (heights.max(axis=1) > depth) & flat[other]
            one, other, heights = one[both_sides], other[both_sides], heights[both_sides]
            for k in range(3):
                l = (k + 1) % 3
                opposite = (heights[:, k] * heights[:, l] < 0) & (np.abs(heights[:, [k, l]]).min(axis=1) > depth)
                share = heights[opposite, k] / (heights[opposite, k] - heights[opposite, l])
                start, end = corners[one[opposite], k], corners[one[opposite], l]
                passed = other[opposite]
                hit = lie_in(start + (end - start) * share[:, None], corners[passed], normals[passed], 1e-3 * depth)
                if hit.any():
                    where = corners[passed[hit][0]].mean(axis=0)
                    raise SurfaceError(f"the surface crosses itself near {place(where)}; unite the parts in the program "
                                       "that drew it (a Boolean union)")


def planes(corners, depth):
    """The unit normal of each triangle, and whether it has a plane: one as thin as depth has none to speak of."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return normals / np.maximum(area, np.finfo(float).tiny)[:, None], area > 4 * depth * longest


def near_pairs(corners):
    """Pairs of triangles whose boxes meet, in portions; the triangles are in the order of their least x."""
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    block = max(1, MOST_PAIRS // len(corners))
    for start in range(0, len(corners), block):
        rows = slice(start, start + block)
        end = np.searchsorted(lower[:, 0], upper[rows, 0].max(), side="right")  # beyond, all lie further along x
        columns = slice(start, end)
        near = np.all((lower[rows, None] <= upper[None, columns]) & (upper[rows, None] >= lower[None, columns]), axis=2)
        a, b = np.nonzero(np.triu(near, 1)) + np.array([[start], [start]])
        yield a, b


def lie_in(points, triangles, normals, margin):
    """Whether each point of a triangle's plane is in it; on an edge counts, or two triangles could pass it to each
    other."""
    inside = np.ones(len(points), dtype=bool)
    for k in range(3):
        tail, way = triangles[:, k], triangles[:, (k + 1) % 3] - triangles[:, k]
        inside &= np.einsum("ij,ij->i", np.cross(way, points - tail), normals) > -margin * np.linalg.norm(way, axis=1)
    return inside


def check_one_body(points, triangles):
    """Refuses a surface that bounds several bodies: shells that lie inside no other one, or inside a cavity."""
    shell = shells(triangles)
    parts = [triangles[shell == k] for k in range(shell.max() + 1)]
    depth = [sum(surrounds(points, other, points[part[0, 0]]) for other in parts if other is not part) for part in parts]
    bodies = [part for part, around in zip(parts, depth) if around % 2 == 0]
    if len(bodies) > 1:
        raise SurfaceError(f"the surface bounds {len(bodies)} separate bodies, one of them at "
                           f"{place(points[bodies[1][0, 0]])}; unite them in the program that drew it (a Boolean "
                           "union), or mesh each by itself")


def drawn_volumes(points, triangles):
    """The volume of the one body that a closed surface bounds, and those of its cavities, the largest first; 0 and none
    where not all triangles of a shell are seen from one side counter-clockwise, so that nobody knows."""
    ways = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    if len(np.unique(ways, axis=0)) < len(ways):
        return 0, []
    centred = points - points.mean(axis=0)
    a, b, c = (centred[triangles[:, k]] for k in range(3))
    under = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    outer, *cavities = sorted(np.abs(np.bincount(shells(triangles), under)), reverse=True)
    return outer - sum(cavities), cavities


def area(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def surrounds(points, shell, p):
    """Whether a closed surface seen from p covers all directions  [Van Oosterom & Strackee, IEEE TBME 30, 1983]."""
    a, b, c = (points[shell[:, k]] - p for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    ab, bc, ca = (np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a)))
    half_angles = np.arctan2(np.einsum("ij,ij->i", a, np.cross(b, c)), la * lb * lc + ab * lc + bc * la + ca * lb)
    return abs(half_angles.sum()) > np.pi  # 2 pi inside, 0 outside


def shells(cells):
    """The connected parts that a set of triangles or tetrahedra falls into: for each the number of its own, from 0."""
    label = np.arange(cells.max() + 1)
    while True:  # the least number of each cell's corners spreads until nothing changes
        least = label[cells].min(axis=1)
        new = label.copy()
        for k in range(cells.shape[1]):
            np.minimum.at(new, cells[:, k], least)
        new = new[new]
        if np.array_equal(new, label):
            break
        label = new
    return np.unique(label[cells[:, 0]], return_inverse=True)[1]
