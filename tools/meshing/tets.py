# SPDX-License-Identifier: Apache-2.0
"""Tetrahedral meshes as arrays: points (n x 3) and the corners of tetrahedra (m x 4) or triangles (k x 3)."""

import numpy as np

from .surface import shells


def signed_volumes(points, tets):
    a, b, c, d = (points[tets[:, i]] for i in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def qualities(points, tets):
    """Mean ratio of every tetrahedron, 1 where regular, 0 where flat: 12 (3 V)^(2/3) / sum of squared edges."""
    edges = sum(np.sum((points[tets[:, i]] - points[tets[:, j]]) ** 2, axis=1) for i in range(4) for j in range(i))
    return 12 * np.cbrt(3 * signed_volumes(points, tets)) ** 2 / edges


def dihedral_angles(points, tets):
    """The six angles between the faces of every tetrahedron, m x 6, degrees."""
    corner = points[tets]
    normals = []
    for i in range(4):
        a, b, c = (corner[:, j] for j in range(4) if j != i)
        n = np.cross(b - a, c - a)
        n *= np.sign(np.einsum("ij,ij->i", n, a - corner[:, i]))[:, None]  # outward: away from the corner opposite
        normals.append(n / np.linalg.norm(n, axis=1)[:, None])
    cosines = [-np.einsum("ij,ij->i", normals[i], normals[j]) for i in range(4) for j in range(i)]
    return np.degrees(np.arccos(np.clip(np.column_stack(cosines), -1, 1)))


def quality_line(points, tets):
    """What a person should know of the shapes, in one line."""
    quality, angles = qualities(points, tets), dihedral_angles(points, tets)
    return (f"mean ratio: worst {quality.min():.3f}, median {np.median(quality):.3f}; "
            f"dihedral angles: {angles.min():.1f}° to {angles.max():.1f}°")


def boundary(tets, with_owner=False):
    """The faces that belong to one tetrahedron only, k x 3, seen from outside counter-clockwise; if asked, also the
    number of that tetrahedron for each."""
    faces = np.vstack([tets[:, i] for i in ([0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3])])
    _, inverse, count = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
    single = count[inverse.ravel()] == 1
    return (faces[single], np.tile(np.arange(len(tets)), 4)[single]) if with_owner else faces[single]


def hinges(tets):
    """Nodes at which parts of a body meet that have no face in common there and nowhere else."""
    faces = np.sort(np.vstack([tets[:, i] for i in ([0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3])]), axis=1)
    owner = np.tile(np.arange(len(tets)), 4)
    order = np.lexsort(faces.T)
    same = np.all(faces[order[1:]] == faces[order[:-1]], axis=1)
    itself = np.arange(len(tets))
    pairs = np.vstack([np.column_stack([itself, itself]), np.column_stack([owner[order[1:]], owner[order[:-1]]])[same]])
    part = shells(pairs)[:len(tets)]
    nodes_of_parts = np.unique(np.column_stack([tets.ravel(), np.repeat(part, 4)]), axis=0)[:, 0]
    nodes, parts = np.unique(nodes_of_parts, return_counts=True)
    return nodes[parts > 1]


def enclosed(points, triangles):
    """The volume in mm³ that triangles seen from outside the body counter-clockwise enclose as a cavity."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return -np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def write_msh(path, points, surfaces, volumes):
    """Gmsh MSH 4.1: an entity for each named surface (triangles) and volume (tetrahedra). Nodes are listed with the
    first surface that they are on, or with the first volume."""
    entities = [(2, 2, name, cells) for name, cells in surfaces.items()]
    entities += [(3, 4, name, cells) for name, cells in volumes.items()]
    owner = np.full(len(points), len(surfaces))
    for k, triangles in reversed(list(enumerate(surfaces.values()))):
        owner[triangles] = k
    order = np.argsort(owner, kind="stable")
    tag = np.argsort(order) + 1

    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(entities))]
    lines += [f'{e[0]} {k + 1} "{e[2]}"' for k, e in enumerate(entities)]
    lines += ["$EndPhysicalNames", "$Entities", f"0 0 {len(surfaces)} {len(volumes)}"]
    for k, (dimension, _, _, cells) in enumerate(entities):
        used = points[np.unique(cells)]
        box = " ".join(f"{v:.8g}" for v in (*used.min(axis=0), *used.max(axis=0)))
        number = k + 1 if dimension == 2 else k + 1 - len(surfaces)
        border = "0" if dimension == 2 else f"{len(surfaces)} " + " ".join(str(n + 1) for n in range(len(surfaces)))
        lines.append(f"{number} {box} 1 {k + 1} {border}")
    lines += ["$EndEntities", "$Nodes", f"{len(surfaces) + 1} {len(points)} 1 {len(points)}"]
    for k in range(len(surfaces) + 1):
        nodes = order[owner[order] == k]
        lines.append(f"{2 if k < len(surfaces) else 3} {k + 1 if k < len(surfaces) else 1} 0 {len(nodes)}")
        lines += [str(tag[n]) for n in nodes]
        lines += [" ".join(f"{v + 0.0:.8g}" for v in points[n]) for n in nodes]
    total = sum(len(e[3]) for e in entities)
    lines += ["$EndNodes", "$Elements", f"{len(entities)} {total} 1 {total}"]
    first = 1
    for k, (dimension, kind, _, cells) in enumerate(entities):
        lines.append(f"{dimension} {k + 1 if dimension == 2 else k + 1 - len(surfaces)} {kind} {len(cells)}")
        lines += [f"{first + i} " + " ".join(str(tag[n]) for n in c) for i, c in enumerate(cells)]
        first += len(cells)
    path.write_text("\n".join(lines + ["$EndElements", ""]))
