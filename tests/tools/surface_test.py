#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Which surfaces tools/mesh takes for sound, and what it reads from STL and OBJ files."""

import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
sys.dont_write_bytecode = True
try:
    import numpy as np

    from meshing.surface import SurfaceError, check_closed, check_does_not_cross_itself, check_one_body, drawn_volumes
    from meshing.surface_files import read_surface, welded
except ImportError as problem:
    print(f"skipped: {problem.name} is not installed")
    sys.exit(0)

SEED = 20


def prism(outline, height, fan):
    """Triangles of a prism on a convex outline (n x 2); those of its ends meet at a corner or at the middle."""
    n = len(outline)
    low, high = np.c_[outline, np.zeros(n)], np.c_[outline, np.full(n, height)]
    triangles = []
    for k in range(n):
        l = (k + 1) % n
        triangles += [(low[k], low[l], high[l]), (low[k], high[l], high[k])]
        if fan == "middle":
            triangles += [(low.mean(0), low[l], low[k]), (high.mean(0), high[k], high[l])]
        elif 1 <= k < n - 1:
            triangles += [(low[0], low[l], low[k]), (high[0], high[k], high[l])]
    return np.array(triangles)


def pyramid(outline, height, fan):
    triangles = prism(outline, 1, fan)
    flat = np.all(triangles[:, :, 2] == 0, axis=1)
    apex = np.append(outline.mean(0), height)
    return np.concatenate([triangles[flat], [(p, q, apex) for p, q in
                           zip(np.c_[outline, 0 * outline[:, 0]], np.c_[np.roll(outline, -1, 0), 0 * outline[:, 0]])]])


def box(size, cells):
    """Triangles of a box with faces of cells x cells squares, each cut in two."""
    triangles, at = [], np.linspace(0, 1, cells + 1)
    for axis in range(3):
        for side in (0, 1):
            for i in range(cells):
                for j in range(cells):
                    corners = np.zeros((4, 3))
                    corners[:, axis] = side
                    corners[:, (axis + 1) % 3] = at[[i, i + 1, i + 1, i]]
                    corners[:, (axis + 2) % 3] = at[[j, j, j + 1, j + 1]]
                    corners = (corners if side else corners[::-1]) * size
                    triangles += [corners[[0, 1, 2]], corners[[0, 2, 3]]]
    return np.array(triangles)


def ring_of_tetrahedra(number):
    """Triangles of a closed ring of tetrahedra, each with one edge of the one before and one of the next; an even number."""
    edges = []
    for k in range(number):
        angle = 2 * np.pi * k / number
        middle = 10 * np.array([np.cos(angle), np.sin(angle), 0])
        along = np.array([0, 0, 1.0]) if k % 2 else np.array([np.cos(angle), np.sin(angle), 0])
        edges.append((middle - along, middle + along))
    triangles = []
    for k in range(number):
        a, b, c, d = *edges[k], *edges[(k + 1) % number]
        if np.dot(np.cross(b - a, c - a), d - a) < 0:
            a, b = b, a
        triangles += [(a, c, b), (a, b, d), (a, d, c), (b, c, d)]
    return np.array(triangles)


def circle(corners):
    angle = np.linspace(0, 2 * np.pi, corners, endpoint=False)
    return 10 * np.c_[np.cos(angle), np.sin(angle)]


def solid(kind, random):
    fan = ("corner", "middle")[random.integers(2)]
    return {"cylinder": lambda: prism(circle(random.integers(3, 31)), random.uniform(1, 60), fan),
            "cone": lambda: pyramid(circle(random.integers(3, 31)), random.uniform(1, 60), fan),
            "box": lambda: box(random.uniform(1, 40, 3), random.integers(1, 4))}[kind]()


def turned(triangles, random):
    """Turned and moved at random, and rounded as files round: to floats of 32 bits."""
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    return (triangles @ turn.T + random.uniform(-100, 100, 3)).astype(np.float32).astype(float)


def check(triangles):
    points, triangles = welded(triangles)
    check_closed(points, triangles)
    check_does_not_cross_itself(points, triangles)
    check_one_body(points, triangles)


class CrossingTest(unittest.TestCase):
    def test_no_turned_solid_crosses_itself(self):
        random = np.random.default_rng(SEED)
        for number in range(1000):
            kind = ("cylinder", "cone", "box")[number % 3]
            with self.subTest(seed=SEED, number=number, kind=kind):
                check(turned(solid(kind, random), random))

    def test_solids_of_which_one_reaches_out_of_another_cross(self):
        random = np.random.default_rng(SEED)
        for number in range(100):
            one = solid(("cylinder", "cone", "box")[number % 3], random)
            other = box(random.uniform(100, 200, 3), random.integers(1, 4))
            other += one.reshape(-1, 3).mean(0) + random.uniform(-0.01, 0.01, 3)
            with self.subTest(seed=SEED, number=number), self.assertRaisesRegex(SurfaceError, "crosses itself near"):
                check(turned(np.concatenate([one, other]), random))

    def test_a_spike_whose_edges_meet_edges_only_crosses(self):
        # Each of its three edges goes through one of the three edges that meet at the middle of the prism's end.
        spike = pyramid(circle(3) / 2, 8, "middle") * [1, 1, -1] + [0, 0, 14]
        with self.assertRaisesRegex(SurfaceError, "crosses itself near"):
            check(np.concatenate([prism(circle(3), 10, "middle"), spike]))

    def test_triangles_that_fold_over_by_rounding_do_not_cross(self):
        # Corners nearly on the long sides of the top: rounding brings some to the other side of them.
        random = np.random.default_rng(SEED)
        for number in range(50):
            inset = np.linspace(0, 10, 12)[1:-1]
            side = np.c_[inset, np.full(10, 1e-6)]
            outline = np.concatenate([[(0, 0)], side * [1, -1], [(10, 0)], [(10, 10)], [(0, 10)]])
            with self.subTest(seed=SEED, number=number):
                check(turned(prism(outline, 10, "corner"), random))


class HingesTest(unittest.TestCase):
    """Bodies that hang together by an edge: there the surface has four triangles, or more."""

    def test_parts_that_hang_together_by_an_edge_are_named_as_such(self):
        cube = box(np.array([1.0, 1, 1]), 1)
        with self.assertRaisesRegex(SurfaceError, r"meet at edges: 1 have four triangles or more, the first at \(1, 1, 0.5\)"):
            check(np.concatenate([cube, cube + [1, 1, 0]]))

    def test_a_ring_of_hinges_is_named_as_such(self):
        for number in (6, 8, 10):
            with self.assertRaisesRegex(SurfaceError, f"meet at edges: {number} have four triangles.*they hang together by an edge"):
                check(ring_of_tetrahedra(number))

    def test_bodies_that_touch_in_a_face_are_to_be_united(self):
        cube = box(np.array([1.0, 1, 1]), 1)
        with self.assertRaisesRegex(SurfaceError, "meet at edges: 4 have .* touch in a face .* unite them"):
            check(np.concatenate([cube, cube + [1, 0, 0]]))

    def test_an_odd_number_of_triangles_at_an_edge_is_no_hinge(self):
        corners = np.array([(0, 0, 0), (1, 0, 0), (0.5, -1, 0), (0.5, 0, 1)])
        wedge = corners[[[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0], [0, 2, 1]]]  # its first face twice
        with self.assertRaisesRegex(SurfaceError, "crosses itself: 3 edges have more than two triangles"):
            check(wedge)


class DrawnVolumeTest(unittest.TestCase):
    def test_a_cavity_is_no_part_of_the_body(self):
        inner = box([4, 4, 4], 2)
        for chamber in (inner, inner[:, ::-1]):  # whichever way it is seen
            body, cavities = drawn_volumes(*welded(np.concatenate([box([10, 10, 10], 1), chamber + 3])))
            self.assertAlmostEqual(body, 1000 - 64)
            self.assertEqual([round(c) for c in cavities], [64])

    def test_nothing_is_said_where_triangles_are_seen_from_either_side(self):
        mixed = box([10, 10, 10], 1)
        mixed[3] = mixed[3, ::-1]
        self.assertEqual(drawn_volumes(*welded(mixed)), (0, []))


BOX = box(np.array([20.0, 20, 30]), 1)


def text_stl(name="part"):
    lines = [f"solid {name}"]
    for triangle in BOX:
        lines += ["facet normal 0 0 0", "outer loop", *("vertex {:.6e} {:.6e} {:.6e}".format(*p) for p in triangle),
                  "endloop", "endfacet"]
    return "\n".join([*lines, f"endsolid {name}", ""])


def binary_stl(count=None, header=b"solid made by a program"):
    records = np.zeros(len(BOX), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("_", "<u2")])
    records["corners"] = BOX
    return header.ljust(80, b"\0") + (len(BOX) if count is None else count).to_bytes(4, "little") + records.tobytes()


class FilesTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def read(self, content, name="a.stl"):
        path = Path(self.folder.name) / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        points, triangles, hint = read_surface(path)
        check_closed(points, triangles, hint)
        return drawn_volumes(points, triangles)[0]

    def refusal(self, content, name="a.stl"):
        with self.assertRaises(SurfaceError) as refused:
            self.read(content, name)
        return str(refused.exception)

    def test_the_way_an_stl_is_written_makes_no_difference(self):
        for content in (text_stl(), text_stl().upper(), text_stl().replace("\n", "\r\n"), text_stl().replace("\n", "\r"),
                        text_stl("vertex 1 2 3"), text_stl("a\u00e4 facet"), text_stl().replace("e+", "D+"),
                        text_stl().replace("vertex 2", "vertex\t +2"), text_stl() + "\n\n",
                        text_stl().replace("\n", " "), text_stl("vertex 1 2 3").replace("\n", " "),
                        text_stl().replace("endsolid part\n", "endsolid part vertex 1 2 3 ").replace("\n", "\t"),
                        text_stl().replace("\nouter", " outer").replace("\nvertex", " vertex").replace("\nend", " end"),
                        text_stl().replace("endsolid part", ""), binary_stl(), binary_stl(header=b"vertex 1 2 3"),
                        binary_stl() + b"\0\0", binary_stl() + b"made by a program", binary_stl() + bytes(500)):
            with self.subTest(content[:40]):
                self.assertAlmostEqual(self.read(content), 12000, places=3)

    def test_a_binary_stl_that_is_cut_short_or_miscounted_is_told(self):
        for content, expected in (
                (binary_stl()[:-20], "announces 12 triangles and has room for 11: it is cut short"),
                (binary_stl()[:-50], "announces 12 triangles and has room for 11: its count is wrong or it is cut short"),
                (binary_stl(0xFFFFFFFF), "announces 4294967295 triangles and has room for 12: its count is wrong"),
                (binary_stl(10), "announces 10 triangles and has room for 12: its count is wrong"),
                (binary_stl(0), "announces 0 triangles and has room for 12: its count is wrong"),
                (binary_stl()[:60], "of 60 bytes is cut short"), (b"", "no triangles are in it")):
            with self.subTest(expected):
                self.assertIn(expected, self.refusal(content))

    def test_a_text_stl_that_is_cut_short_is_told(self):
        lines = text_stl().splitlines()  # a name, then seven lines for each triangle
        for content, expected in (
                (lines[:5], "cut short: the last of its 1 facets has 2 corners"),
                (lines[:16], "cut short: the last of its 3 facets has 0 corners"),
                (lines[:15], "is not closed: 4 edges"), (lines[:15], "; the file has no 'endsolid': is it cut short?"),
                (lines[:3] + ["vertex 0.0"] + lines[4:], "a.stl:4: found 'vertex 0.0', expected three numbers"),
                (lines[:3] + lines[4:], "a.stl:8: found a facet after 2 corners, expected three for each")):
            with self.subTest(expected):
                self.assertIn(expected, self.refusal("\n".join(content)))

    def test_solids_in_one_line_follow_each_other(self):
        half = [text_stl().splitlines() for _ in range(2)]
        cut = 1 + 7 * (len(BOX) // 2)
        one, other = half[0][:cut] + ["endsolid part"], ["solid other"] + half[1][cut:]
        self.assertAlmostEqual(self.read(" ".join(one + other)), 12000, places=3)
        self.assertIn("found 'vertex 0.0 1', expected three numbers",
                      self.refusal(" ".join(one + ["solid x facet normal 0 0 0 outer loop vertex 0.0 1 endloop"])))

    def test_an_obj_names_points_that_are_there(self):
        points = "\n".join("v {} {} {}".format(*p) for p in BOX.reshape(-1, 3))
        faces = "\n".join(f"F {k}/1/1 {k - 36} {k + 2}" if k % 2 else f"f {k} {k + 1} {k + 2}" for k in range(1, 37, 3))
        self.assertAlmostEqual(self.read(f"# made\n{points}\n{faces}\n".replace("v ", "V ", 3), "a.obj"), 12000)
        for face in ("f 1 2 37", "f 1 2 0", "f -40 -1 -2", "f 1 2", "f 1 2 x"):
            self.assertIn(f"a.obj:37: found '{face}', expected numbers of points", self.refusal(f"{points}\n{face}", "a.obj"))
        self.assertIn("a.obj:1: found 'v 1 2', expected three numbers", self.refusal("v 1 2\nf 1 1 1", "a.obj"))


if __name__ == "__main__":
    unittest.main()
