#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What tools/mesh makes of small surfaces, read back by gmsh, and what it refuses."""

import contextlib
import importlib.machinery
import importlib.util
import io
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
sys.dont_write_bytecode = True
try:
    import gmsh
    import numpy as np

    loader = importlib.machinery.SourceFileLoader("mesh", str(ROOT / "tools" / "mesh"))
    mesh = importlib.util.module_from_spec(importlib.util.spec_from_loader("mesh", loader))
    loader.exec_module(mesh)
except ImportError as problem:
    print(f"skipped: {problem.name} is not installed")
    sys.exit(0)

SEED = 4
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def box(lower, upper):
    """The twelve triangles of a box, 12 x 3 x 3."""
    corners = np.array([[x, y, z] for x in (lower[0], upper[0]) for y in (lower[1], upper[1])
                        for z in (lower[2], upper[2])], dtype=float)
    return corners[[t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]]


def write_stl(path, triangles):
    lines = ["solid s"]
    for t in triangles:
        lines += ["facet normal 0 0 0", "outer loop", *("vertex {} {} {}".format(*p) for p in t), "endloop", "endfacet"]
    path.write_text("\n".join(lines + ["endsolid s"]))


def write_binary_stl(path, triangles):
    records = np.zeros(len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("_", "<u2")])
    records["corners"] = triangles
    path.write_bytes(bytes(80) + len(triangles).to_bytes(4, "little") + records.tobytes())


def write_obj(path, triangles):
    lines = ["v {} {} {}".format(*p) for p in triangles.reshape(-1, 3)]
    lines += [f"f {k}//1 {k + 1}//1 {k + 2}//1" for k in range(1, len(lines), 3)]
    path.write_text("\n".join(lines))


def write_step(path, boxes):
    gmsh.initialize(["gmsh"], readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    for lower, size in boxes:
        gmsh.model.occ.addBox(*lower, *size)
    gmsh.model.occ.synchronize()
    with contextlib.redirect_stdout(io.StringIO()):
        gmsh.write(str(path))
    gmsh.finalize()


def read_groups(path):
    """For each named group of a mesh its dimension, number of nodes, and signed volume of its tetrahedra."""
    gmsh.initialize(["gmsh"], readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(str(path))
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    place = dict(zip(tags, coordinates.reshape(-1, 3)))
    groups = {}
    for dimension, group in gmsh.model.getPhysicalGroups():
        volume = 0.0
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, group):
            for a, b, c, d in gmsh.model.mesh.getElementsByType(4, entity)[1].reshape(-1, 4):
                volume += np.dot(np.cross(place[b] - place[a], place[c] - place[a]), place[d] - place[a]) / 6
        nodes = gmsh.model.mesh.getNodesForPhysicalGroup(dimension, group)[0]
        groups[gmsh.model.getPhysicalName(dimension, group)] = (dimension, len(nodes), volume)
    gmsh.finalize()
    return groups


class MeshTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return Path(self.folder.name) / name

    def run_mesh(self, *arguments):
        """What the command prints and its exit code."""
        sys.argv = ["mesh", *map(str, arguments)]
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
            try:
                code = mesh.main()
            except SystemExit as end:  # argparse
                code = end.code
        return out.getvalue() + err.getvalue(), code

    def refusal(self, triangles):
        write_stl(self.path("bad.stl"), triangles)
        said, code = self.run_mesh(self.path("bad.stl"), "--size", "5mm")
        self.assertEqual(code, 1)
        self.assertFalse(self.path("bad.msh").exists())
        return said

    def test_a_surface_in_a_surface_becomes_a_cavity(self):
        shape = np.concatenate([box((0, 0, 0), (20, 20, 30)), box((5, 5, 5), (15, 15, 25))])
        for write in (write_stl, write_binary_stl):
            with self.subTest(write.__name__):
                write(self.path("hollow.stl"), shape)
                said, code = self.run_mesh(self.path("hollow.stl"), "--size", "5mm")
                self.assertEqual(code, 0, said)
                self.assertIn("encloses 2 ml", said)
                self.assertNotIn("sliver", said)
                groups = read_groups(self.path("hollow.msh"))
                self.assertEqual({name: g[0] for name, g in groups.items()}, {"body": 3, "cavity": 2})
                self.assertAlmostEqual(groups["body"][2], 20 * 20 * 30 - 10 * 10 * 20, places=4)
                self.assertTrue(self.path("hollow.png").exists())

    def test_units_and_regions_of_an_obj_file(self):
        write_obj(self.path("bar.obj"), box((0, 0, 0), (1, 1, 3)))
        said, code = self.run_mesh(self.path("bar.obj"), "--unit", "cm", "--size", "5mm", "--region", "base=0 0 0 1 1 0")
        self.assertEqual(code, 0, said)
        self.assertIn("body: 3 cm³", said)
        groups = read_groups(self.path("bar.msh"))
        self.assertAlmostEqual(groups["body"][2], 3, places=6)  # the file's unit is kept
        self.assertEqual(groups["base"][0], 2)
        self.assertGreaterEqual(groups["base"][1], 9)  # two edges of 5 mm along each side of 10 mm

    def test_the_solids_of_a_step_file_share_their_nodes(self):
        write_step(self.path("two.step"), [((0, 0, 0), (10, 10, 10)), ((10, 0, 0), (20, 10, 10))])
        said, code = self.run_mesh(self.path("two.step"), "--size", "5mm", "-o", self.path("out.msh"))
        self.assertEqual(code, 0, said)
        groups = read_groups(self.path("out.msh"))
        self.assertAlmostEqual(groups["body1"][2], 1000, places=4)
        self.assertAlmostEqual(groups["body2"][2], 2000, places=4)
        total = int(said.split(" nodes")[0])
        self.assertGreaterEqual(groups["body1"][1] + groups["body2"][1], total + 9)  # those of the wall count twice

    def test_what_cannot_be_meshed_is_refused_with_its_place(self):
        self.assertIn("not closed: 3 edges", self.refusal(box((0, 0, 0), (20, 20, 30))[1:]))
        crossing = np.concatenate([box((0, 0, 0), (20, 20, 30)), box((10, 5, 5), (35, 15, 25))])
        self.assertIn("crosses itself near (", self.refusal(crossing))
        self.assertIn("no triangles", self.refusal([]))
        said, code = self.run_mesh(self.path("missing.stl"), "--size", "5mm")
        self.assertEqual(code, 2)
        self.assertIn(f"mesh: there is no file {self.path('missing.stl')}", said)
        write_stl(self.path("box.stl"), box((0, 0, 0), (20, 20, 30)))
        said, code = self.run_mesh(self.path("box.stl"), "--size", "8mm", "--region", "far=90 90 90 99 99 99")
        self.assertEqual(code, 1)
        self.assertIn("region 'far': no triangle", said)

    def test_turned_solids_are_meshed(self):
        random = np.random.default_rng(SEED)
        for number in range(6):
            turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
            write_binary_stl(self.path("turned.stl"), box((0, 0, 0), (20, 20, 30)) @ turn.T + random.uniform(-90, 90, 3))
            said, code = self.run_mesh(self.path("turned.stl"), "--size", "8mm")
            with self.subTest(seed=SEED, number=number):
                self.assertEqual(code, 0, said)
                self.assertRegex(said, "body: 12 cm³\n")

    def test_volume_lost_to_a_coarse_size_is_told(self):
        angle = np.linspace(0, 2 * np.pi, 65)
        x, y = 10 * np.cos(angle), 10 * np.sin(angle)
        rod = [t for k in range(64) for t in (
            [(x[k], y[k], 0), (x[k + 1], y[k + 1], 0), (x[k + 1], y[k + 1], 40)],
            [(x[k], y[k], 0), (x[k + 1], y[k + 1], 40), (x[k], y[k], 40)],
            [(0, 0, 0), (x[k + 1], y[k + 1], 0), (x[k], y[k], 0)], [(0, 0, 40), (x[k], y[k], 40), (x[k + 1], y[k + 1], 40)])]
        write_stl(self.path("rod.stl"), rod)
        for size, warned in (("12mm", True), ("4mm", False)):
            said, code = self.run_mesh(self.path("rod.stl"), "--size", size)
            self.assertEqual(code, 0, said)
            self.assertRegex(said, r"body: 1[0-2]\.?\d* cm³, [\d.]+ % less than drawn")
            self.assertEqual("mesh: a volume differs by " in said, warned, said)
            self.assertIn("no cavity: no closed surface is inside another (a chamber with an air inlet is open", said)

    def test_a_size_that_makes_millions_of_tetrahedra_is_refused_at_once(self):
        write_stl(self.path("box.stl"), box((0, 0, 0), (20, 20, 30)))
        write_step(self.path("box.step"), [((0, 0, 0), (20, 20, 30))])
        for name, arguments, extent in (("box.stl", ["--size", "0.01mm"], "20 x 20 x 30 mm"),
                                        ("box.step", ["--size", "0.01mm"], "20 x 20 x 30 mm"),
                                        ("box.stl", ["--size", "5mm", "--unit", "m"], "20 x 20 x 30 m")):
            said, code = self.run_mesh(self.path(name), *arguments)
            self.assertEqual(code, 1)
            self.assertIn(f"the body is {extent} large", said)
            self.assertIn("tetrahedra of it, expected 1,000,000 at most; ask for a larger --size", said)

    def test_parts_that_meet_at_an_edge_are_told(self):
        for second, expected in (((10, 10, 0), True), ((10, 0, 0), False)):
            write_step(self.path("two.step"), [((0, 0, 0), (10, 10, 10)), (second, (20, 10, 10))])
            said, code = self.run_mesh(self.path("two.step"), "--size", "5mm")
            self.assertEqual(code, 0, said)
            self.assertEqual("meet without a common face, at 3 nodes, one of them at (10, 10, " in said, expected, said)

    def test_a_size_has_a_unit(self):
        write_stl(self.path("box.stl"), box((0, 0, 0), (20, 20, 30)))
        for size in ("5", "5 inch", "0mm", "1.2.3mm"):
            said, code = self.run_mesh(self.path("box.stl"), "--size", size)
            self.assertEqual(code, 2)
            self.assertIn(f"found '{size}', expected a length above 0 and its unit (m, cm, mm or um), as in 5mm", said)
        said, code = self.run_mesh(self.path("box.stl"), "--size", "1e-2m")
        self.assertEqual(code, 0, said)

    def test_bodies_that_do_not_meet_are_told(self):
        pair = [box((0, 0, 0), (20, 20, 20)), box((30, 0, 0), (50, 20, 20))]
        self.assertIn("bounds 2 separate bodies, one of them at (30, 0, 0)", self.refusal(np.concatenate(pair)))
        nested = [box((0, 0, 0), (30, 30, 30)), box((5, 5, 5), (25, 25, 25)), box((10, 10, 10), (20, 20, 20))]
        self.assertIn("bounds 2 separate bodies", self.refusal(np.concatenate(nested)))
        for gap, expected in ((5, True), (0, False)):
            write_step(self.path("two.step"), [((0, 0, 0), (10, 10, 10)), ((10 + gap, 0, 0), (20, 10, 10))])
            said, code = self.run_mesh(self.path("two.step"), "--size", "5mm")
            self.assertEqual(code, 0, said)
            self.assertEqual("the body falls into 2 parts that share no node" in said, expected)


if __name__ == "__main__":
    unittest.main()
