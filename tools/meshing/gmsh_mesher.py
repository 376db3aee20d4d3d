# SPDX-License-Identifier: Apache-2.0
"""Tetrahedra from gmsh."""

import contextlib
import math

import gmsh
import numpy as np

from .surface import SurfaceError

RIDGE = math.radians(40)  # faces that meet at a larger angle stay parted by an edge
LINE, TRIANGLE, TETRAHEDRON = 1, 2, 4  # gmsh's element types
MOST_TETRAHEDRA = 1_000_000  # a model of more is refreshed too seldom to control anything


@contextlib.contextmanager
def session(size):
    """gmsh, set up for edges of that length; what it refuses becomes a SurfaceError."""
    gmsh.initialize(["gmsh"], readConfigFiles=False)
    try:
        for option, value in {"General.Terminal": 0, "General.NumThreads": 1, "Mesh.RandomSeed": 1,
                              "Mesh.Algorithm": 6, "Mesh.Algorithm3D": 1, "Mesh.Optimize": 1,
                              "Mesh.OptimizeThreshold": 0.5, "Mesh.MeshSizeMin": size, "Mesh.MeshSizeMax": size}.items():
            gmsh.option.setNumber(option, value)
        gmsh.logger.start()
        yield
    except SurfaceError:
        raise
    except Exception as problem:  # gmsh raises nothing more precise
        errors = [line.removeprefix("Error: ") for line in gmsh.logger.get() if line.startswith("Error")]
        raise SurfaceError(f"gmsh cannot mesh this: {'; '.join(errors) or problem}; try another --size, or repair the "
                           "surface") from problem
    finally:
        gmsh.finalize()


def check_size(size, volume, area, extent, unit):
    """Refuses an edge length that makes more tetrahedra than a model can have. Those inside fill the volume, and each
    triangle of the surface has one; the number is right within a factor of two."""
    estimate = 6 * volume / size**3 + 2 * area / size**2
    if estimate > MOST_TETRAHEDRA:
        raise SurfaceError(f"the body is {' x '.join(f'{e:.3g}' for e in extent)} {unit} large, and edges of {size:.3g} "
                           f"{unit} make about {estimate:.1g} tetrahedra of it, expected {MOST_TETRAHEDRA:,} at most; ask "
                           "for a larger --size, or say what 1 is in the file (--unit)")


def from_surface(points, triangles, size):
    """Points and tetrahedra of the body that a closed triangulated surface bounds; its inner shells are cavities."""
    with session(size):
        tag = gmsh.model.addDiscreteEntity(2)
        gmsh.model.mesh.addNodes(2, tag, np.arange(1, len(points) + 1), points.ravel())
        gmsh.model.mesh.addElementsByType(tag, TRIANGLE, [], (triangles + 1).ravel())
        gmsh.model.mesh.classifySurfaces(RIDGE, True, True, math.pi)
        gmsh.model.mesh.createGeometry()
        loop = gmsh.model.geo.addSurfaceLoop([tag for _, tag in gmsh.model.getEntities(2)])
        gmsh.model.geo.addVolume([loop])
        gmsh.model.geo.synchronize()
        return generate()[:2]


def from_step(path, size, unit):
    """Of a STEP file in that unit: points, tetrahedra, for each of these the number of its solid, from 0, and the volume
    drawn of each solid."""
    with session(size):
        gmsh.option.setString("Geometry.OCCTargetUnit", unit.upper())
        gmsh.model.occ.importShapes(str(path))
        gmsh.model.occ.synchronize()
        solids = gmsh.model.getEntities(3)
        if not solids:
            raise RuntimeError("no solid is in the file, only surfaces or curves")
        if len(solids) > 1:
            gmsh.model.occ.fragment(solids[:1], solids[1:])  # neighbours share the triangles between them
            gmsh.model.occ.synchronize()
        volumes = [gmsh.model.occ.getMass(*entity) for entity in gmsh.model.getEntities(3)]
        area = sum(gmsh.model.occ.getMass(*entity) for entity in gmsh.model.getEntities(2))
        box = np.array(gmsh.model.getBoundingBox(-1, -1))
        check_size(size, sum(volumes), area, box[3:] - box[:3], unit)
        return *generate(), volumes


def generate():
    gmsh.model.mesh.generate(3)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    row = np.zeros(int(tags.max()) + 1, dtype=int)
    row[tags.astype(int)] = np.arange(len(tags))
    tets, solid = [np.zeros((0, 4), dtype=int)], []
    for number, (_, tag) in enumerate(gmsh.model.getEntities(3)):
        _, corners = gmsh.model.mesh.getElementsByType(TETRAHEDRON, tag)
        tets.append(row[corners.astype(int)].reshape(-1, 4))
        solid += [number] * len(tets[-1])
    tets = np.vstack(tets)
    if len(tets) == 0:
        raise RuntimeError("no tetrahedra came out")
    used, numbered = np.unique(tets, return_inverse=True)
    return coordinates.reshape(-1, 3)[used], numbered.reshape(-1, 4), np.array(solid)
