"""The inside of the process that reads meshes; see `descriptions.meshes` and `model_file`."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import shapely
import trimesh

from drake_navbench.errors import one_line
from drake_navbench.inputs.descriptions.mesh_slices import cut
from drake_navbench.kernels.arrays import Array
from drake_navbench.typed_files.input_file import LFS_POINTER, POINTER, read_head

MAX_TRIANGLES = 1_000_000
# A replay with more triangles loads slowly.
MAX_DRAWN = 100_000
# No part of a robot or a world is farther away than this, m.
FARTHEST_M = 1e6
COLLADA = ".dae"
STL = ".stl"
# A binary STL file: a text of 80 bytes, the number of triangles, then the triangles.
STL_HEAD_BYTES, STL_TRIANGLE_BYTES = 84, 50
SUFFIXES = (STL, ".obj", COLLADA, ".glb", ".gltf", ".ply")
# The unit in the head of a COLLADA file, in metres. Its up axis is ignored, as Gazebo
# (gazebo-classic #1305) and ROS ignore it: files of robots and worlds rely on that.
UNIT = re.compile(r"<unit\b[^>]*\bmeter\s*=\s*[\"']([^\"']+)")
ASSET_BYTES = 20_000


def outlines(requests: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Returns for each mesh the hull of its points over the floor, and its lowest and highest.

    requests: file, submesh, is_centred and transform (4, 4) each. The answer for an unreadable mesh
    is its `fault`.
    """
    return [_answer(mesh, _outline) for mesh in requests]


def sections(requests: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Returns for each mesh the areas that it covers at heights: rings of corners (K, 2) m.

    requests: as for `outlines`, and bands: the heights of each cut.
    """
    return [_answer(mesh, _section) for mesh in requests]


def write_objs(requests: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Writes each mesh as OBJ, in metres, into the file `obj`; returns the `fault` where it fails.

    requests: `file` and `obj` of each mesh. A mesh of more than MAX_DRAWN triangles is written as
    its convex hull.
    """
    return [_answer({**mesh, "transform": np.eye(4)}, _written) for mesh in requests]


def _written(corners: Array, mesh: dict[str, Any]) -> dict[str, Any]:
    if len(corners) > MAX_DRAWN:
        hull = trimesh.convex.convex_hull(corners.reshape(-1, 3))
        corners = np.asarray(hull.vertices[hull.faces])
    points = corners.reshape(-1, 3)
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points]
    lines += [f"f {first} {first + 1} {first + 2}" for first in range(1, len(points), 3)]
    Path(mesh["obj"]).write_text("\n".join([*lines, ""]), encoding="utf-8")
    return {"obj": mesh["obj"]}


def _answer(mesh: dict[str, Any], work: Any) -> dict[str, Any]:
    try:
        corners = read_corners(
            Path(mesh["file"]), mesh.get("submesh", ""), bool(mesh.get("is_centred"))
        )
        transform = np.array(mesh["transform"])
        placed = corners @ transform[:3, :3].T + transform[:3, 3]
        farthest_m = float(np.abs(placed).max())
        if not farthest_m <= FARTHEST_M:
            raise ValueError(f"reaches {farthest_m:.3g} m, expected at most {FARTHEST_M:g} m")
        return dict(work(placed, mesh))
    except MemoryError:
        raise
    except Exception as error:
        text = str(error) if isinstance(error, ValueError) else one_line(error)
        return {"fault": text or one_line(error)}


def _outline(corners: Array, mesh: dict[str, Any]) -> dict[str, Any]:
    points = corners.reshape(-1, 3)
    hull = shapely.MultiPoint(np.unique(points[:, :2].round(5), axis=0)).convex_hull
    return {
        "corners": shapely.get_coordinates(hull).tolist(),
        "low": float(points[:, 2].min()),
        "high": float(points[:, 2].max()),
    }


def _section(corners: Array, mesh: dict[str, Any]) -> dict[str, Any]:
    points = corners.reshape(-1, 3)
    return {
        "bands": [cut(corners, heights) for heights in mesh["bands"]],
        "low": float(points[:, 2].min()),
        "high": float(points[:, 2].max()),
        "bounds": [*points[:, :2].min(axis=0).tolist(), *points[:, :2].max(axis=0).tolist()],
    }


def read_corners(path: Path, submesh: str = "", is_centred: bool = False) -> Array:
    """Returns the corners (T, 3, 3) m of a mesh's triangles.

    submesh: the name of the only part that counts, '' for all; is_centred: whether this part is
    moved to the origin. Raises ValueError where there are no triangles or too many.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"expected a mesh in {', '.join(SUFFIXES)}")
    if read_head(path, len(LFS_POINTER)) == LFS_POINTER:
        raise ValueError(POINTER)
    _require_few_in_stl(path)
    options: dict[str, Any] = {"skip_materials": True} if suffix == ".obj" else {}
    scene = trimesh.load_scene(path, **options)
    parts = []
    for name in scene.graph.nodes_geometry:
        transform, geometry_name = scene.graph[name]
        geometry = scene.geometry[geometry_name]
        if not isinstance(geometry, trimesh.Trimesh):
            continue
        if submesh and submesh not in (name, geometry_name, geometry.metadata.get("name")):
            continue
        if len(geometry.faces) > MAX_TRIANGLES:
            raise ValueError(_too_many(len(geometry.faces)))
        points = geometry.vertices @ transform[:3, :3].T + transform[:3, 3]
        parts.append(points[geometry.faces])
    if submesh and not parts:
        return read_corners(path)
    if not parts:
        raise ValueError("expected triangles, found none")
    corners = np.vstack(parts).astype(float)
    if not len(corners):
        raise ValueError("expected triangles with finite corners, found none")
    if len(corners) > MAX_TRIANGLES:
        raise ValueError(_too_many(len(corners)))
    if not np.isfinite(corners).all():
        raise ValueError("expected finite corners")
    if suffix == COLLADA:
        corners = corners * _unit_m(path)
    if is_centred:
        points = corners.reshape(-1, 3)
        corners = corners - 0.5 * (points.min(axis=0) + points.max(axis=0))
    return corners


def _require_few_in_stl(path: Path) -> None:
    """Raises ValueError where the header of a binary STL file announces too many triangles."""
    if path.suffix.lower() != STL:
        return
    with path.open("rb") as file:
        count = int.from_bytes(file.read(STL_HEAD_BYTES)[80:], "little")
    is_binary = path.stat().st_size == STL_HEAD_BYTES + count * STL_TRIANGLE_BYTES
    if is_binary and count > MAX_TRIANGLES:
        raise ValueError(_too_many(count))


def _too_many(count: int) -> str:
    return f"has {count} triangles, expected at most {MAX_TRIANGLES}"


def _unit_m(path: Path) -> float:
    """Returns the unit of a COLLADA file according to its head, m."""
    with path.open(encoding="utf-8", errors="replace") as file:
        unit = UNIT.search(file.read(ASSET_BYTES))
    return float(unit[1]) if unit else 1.0
