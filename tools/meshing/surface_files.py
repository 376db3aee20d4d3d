# SPDX-License-Identifier: Apache-2.0
"""Triangles from STL and OBJ files."""

import re

import numpy as np

from .surface import WELD, SurfaceError


def read_surface(path):
    """Points (n x 3) and triangles (k x 3) of an STL or OBJ file, equal corners welded, and what to add where the
    surface turns out to be open."""
    corners, hint = {".stl": read_stl, ".obj": read_obj}[path.suffix.lower()](path)
    if len(corners) == 0:
        raise SurfaceError(f"{path}: no triangles are in it")
    if not np.isfinite(corners).all():
        raise SurfaceError(f"{path}: some coordinates are not finite")
    return *welded(corners), hint


def welded(corners):
    """Points and triangles of corners, k x 3 x 3; triangles with two equal corners are left out."""
    flat = corners.reshape(-1, 3)
    size = np.linalg.norm(np.ptp(flat, axis=0))
    grid = np.round(flat / (WELD * size if size > 0 else 1)).astype(np.int64)
    _, first, index = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    triangles = index.reshape(-1, 3)
    distinct = np.all(triangles != np.roll(triangles, 1, axis=1), axis=1)
    if not distinct.any():
        raise SurfaceError("all triangles of the surface have equal corners")
    return flat[first], triangles[distinct]


def read_stl(path):
    data = path.read_bytes()
    is_whole_binary = len(data) >= 84 and len(data) == 84 + 50 * announced(data)
    return read_binary_stl(path, data) if is_whole_binary or b"\0" in data[:1000] else read_text_stl(path, data)


def announced(data):
    return int.from_bytes(data[80:84], "little")


def read_binary_stl(path, data):
    if len(data) < 84:
        raise SurfaceError(f"{path}: a binary STL of {len(data)} bytes is cut short, expected 84 and 50 for each triangle")
    count, room = announced(data), (len(data) - 84) // 50
    rest = data[84 + 50 * count:]
    if count > room or (count < room and (count == 0 or (len(rest) % 50 == 0 and any(rest)))):
        cause = "it is cut short" if (len(data) - 84) % 50 else "its count is wrong or it is cut short"
        raise SurfaceError(f"{path}: a binary STL that announces {count} triangles and has room for {room}: {cause}; write "
                           "it again")
    records = np.frombuffer(data, offset=84, count=count,
                            dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("_", "<u2")])
    return records["corners"].astype(float), ""


STATEMENT = re.compile(r"(?i)(?<!\S)(?:facet|outer|vertex|endloop|endfacet|endsolid|solid)(?!\S)")
FIRST_FACET = re.compile(r"(?i)(?<!\S)facet\s+normal(?!\S)")


def statements(line):
    """The statements of a line: an STL may have many in one, up to the whole file. The name of a solid may hold any words,
    and ends where a facet begins."""
    at = 0
    while at < len(line):
        named = line[at:at + 8].lower().lstrip().startswith(("solid", "endsolid"))
        following = (FIRST_FACET if named else STATEMENT).search(line, at + 1)
        end = following.start() if following else len(line)
        yield line[at:end]
        at = end


def read_text_stl(path, data):
    corners, facets, ended = [], 0, False
    lines = re.split(r"\r\n|\r|\n", data.decode("latin-1"))
    for number, statement in ((n, s) for n, line in enumerate(lines, 1) for s in statements(line)):
        words = statement.lower().split()
        if not words:
            continue
        if words[0] == "vertex":
            corners.append(coordinates(path, number, statement, words[1:]))
        elif words[0] == "facet":
            if len(corners) != 3 * facets:
                raise SurfaceError(f"{path}:{number}: found a facet after {len(corners) - 3 * (facets - 1)} corners, "
                                   "expected three for each")
            facets += 1
        elif words[0] in ("solid", "endsolid"):
            ended = words[0] == "endsolid"
    if len(corners) != 3 * facets:
        raise SurfaceError(f"{path}: an STL that is cut short: the last of its {facets} facets has "
                           f"{len(corners) - 3 * (facets - 1)} corners; write it again")
    return np.array(corners).reshape(-1, 3, 3), "" if ended else "; the file has no 'endsolid': is it cut short?"


def coordinates(path, number, line, words):
    """Three numbers, maybe with Fortran's exponent D."""
    try:
        x, y, z = (float(w.replace("d", "e")) for w in words)
    except ValueError:
        raise SurfaceError(f"{path}:{number}: found '{line.strip()}', expected three numbers") from None
    return x, y, z


def read_obj(path):
    points, triangles = [], []
    for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
        words = line.lower().split()
        if words[:1] == ["v"]:
            points.append(coordinates(path, number, line, words[1:4]))
        elif words[:1] == ["f"]:
            try:
                index = [int(w.split("/")[0]) for w in words[1:]]
            except ValueError:
                index = []
            index = [i - 1 if i > 0 else len(points) + i for i in index]
            if len(index) < 3 or not all(0 <= i < len(points) for i in index):
                raise SurfaceError(f"{path}:{number}: found '{line.strip()}', expected numbers of points that are there")
            triangles += [[points[index[0]], points[a], points[b]] for a, b in zip(index[1:], index[2:])]
    return np.array(triangles, dtype=float).reshape(-1, 3, 3), ""
