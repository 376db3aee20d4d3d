"""Triangulated surfaces from STL and OBJ files, and whether they enclose a body."""

import re

import numpy as np

WELD = 1e-6  # corners closer than this share of the surface's size are one
MOST_PAIRS = 4_000_000  # of triangles compared at once, to bound the memory


class SurfaceError(Exception):
    """What is wrong with a surface, where, and what to do about it."""


def read_surface(path):
    """Points (n x 3) and triangles (k x 3) of an STL or OBJ file, equal corners welded."""
    corners = {".stl": read_stl, ".obj": read_obj}[path.suffix.lower()](path)
    if len(corners) == 0:
        raise SurfaceError(f"{path}: no triangles are in it")
    if not np.isfinite(corners).all():
        raise SurfaceError(f"{path}: some coordinates are not finite")
    flat = corners.reshape(-1, 3)
    grid = np.round(flat / (WELD * np.linalg.norm(np.ptp(flat, axis=0)))).astype(np.int64)
    _, first, index = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    triangles = index.reshape(-1, 3)
    distinct = np.all(triangles != np.roll(triangles, 1, axis=1), axis=1)
    return flat[first], triangles[distinct]


def read_stl(path):
    data = path.read_bytes()
    if len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        records = np.frombuffer(data, offset=84, dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("_", "<u2")])
        return records["corners"].astype(float)
    number = rb"\s+([-+\d.eE]+)"
    corners = np.array(re.findall(rb"vertex" + 3 * number, data), dtype=float)
    if len(corners) % 3:
        raise SurfaceError(f"{path}: {len(corners)} corners are in it, expected three for each triangle")
    return corners.reshape(-1, 3, 3)


def read_obj(path):
    points, triangles = [], []
    for line_number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
        words = line.split()
        try:
            if words[:1] == ["v"]:
                points.append([float(w) for w in words[1:4]])
            elif words[:1] == ["f"]:
                index = [int(w.split("/")[0]) for w in words[1:]]
                index = [i - 1 if i > 0 else len(points) + i for i in index]
                triangles += [[points[index[0]], points[a], points[b]] for a, b in zip(index[1:], index[2:])]
        except (ValueError, IndexError):
            raise SurfaceError(f"{path}:{line_number}: found '{line.strip()}', expected numbers of points that are "
                               "there") from None
    return np.array(triangles, dtype=float).reshape(-1, 3, 3)


def place(p):
    return f"({p[0]:.4g}, {p[1]:.4g}, {p[2]:.4g})"


def check_closed(points, triangles):
    """Refuses a surface with an edge of one triangle, or of more than two."""
    edges = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    for wrong, what in ((count == 1, "is not closed: {} edges have a triangle on one side only"),
                        (count > 2, "crosses itself: {} edges have more than two triangles")):
        if wrong.any():
            middles = points[edges[wrong]].mean(axis=1)
            raise SurfaceError(f"the surface {what.format(wrong.sum())}, the first at {place(middles[0])}; repair it in "
                               "the program that drew it, in MeshLab (Close Holes) or in Blender (3D Print Toolbox)")


def check_does_not_cross_itself(points, triangles):
    """Refuses a surface of which an edge goes through a triangle  [Möller & Trumbore, J. Graphics Tools 2, 1997]."""
    triangles = triangles[np.argsort(points[triangles, 0].min(axis=1))]
    corners = points[triangles]
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    block = max(1, MOST_PAIRS // len(triangles))
    for start in range(0, len(triangles), block):
        rows = slice(start, start + block)
        end = np.searchsorted(lower[:, 0], upper[rows, 0].max(), side="right")  # beyond, all lie further along x
        columns = slice(start, end)
        near = np.all((lower[rows, None] <= upper[None, columns]) & (upper[rows, None] >= lower[None, columns]), axis=2)
        a, b = np.nonzero(near) + np.array([[start], [start]])
        neighbours = (triangles[a][:, :, None] == triangles[b][:, None, :]).sum(axis=(1, 2))
        a, b = a[neighbours < 2], b[neighbours < 2]
        for one, other in ((a, b), (b, a)):
            for k in range(3):
                crossing = goes_through(corners[one, k], corners[one, (k + 1) % 3], corners[other])
                if crossing.any():
                    where = corners[other[crossing][0]].mean(axis=0)
                    raise SurfaceError(f"the surface crosses itself near {place(where)}; unite the parts in the program "
                                       "that drew it (a Boolean union)")


def goes_through(start, end, triangles, margin=1e-9):
    """Whether each segment goes through the inside of its triangle."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    way = end - start
    h = np.cross(way, c - a)
    determinant = np.einsum("ij,ij->i", b - a, h)
    with np.errstate(divide="ignore", invalid="ignore"):  # a segment parallel to the triangle gives no number
        u = np.einsum("ij,ij->i", start - a, h) / determinant
        q = np.cross(start - a, b - a)
        v = np.einsum("ij,ij->i", way, q) / determinant
        t = np.einsum("ij,ij->i", c - a, q) / determinant
        inside = (u > margin) & (v > margin) & (u + v < 1 - margin) & (t > margin) & (t < 1 - margin)
    scale = np.linalg.norm(way, axis=1) * np.linalg.norm(b - a, axis=1) * np.linalg.norm(c - a, axis=1)
    return inside & (np.abs(determinant) > margin * scale)


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
