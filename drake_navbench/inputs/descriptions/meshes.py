"""Meshes, read in a process with bounds on memory and time; results are cached."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from drake_navbench.errors import CannotBeWritten, InputError
from drake_navbench.inputs.descriptions.model import Shape
from drake_navbench.inputs.descriptions.robots_extra import HOW_TO_INSTALL
from drake_navbench.kernels.arrays import Array
from drake_navbench.processes.cache_folder import user_cache_folder
from drake_navbench.processes.limited_call import call_limited
from drake_navbench.typed_files.input_file import MEGABYTE, file_digest
from drake_navbench.typed_files.output_file import write_text

MAX_MESH_BYTES = 500 * MEGABYTE
# A replay with a larger mesh loads slowly.
MAX_DRAWN_BYTES = 20 * MEGABYTE
FOLDER = "meshes"
# To be changed whenever the same file would be read differently, or the cache has another form.
VERSION = 6
# A mesh that took too long is tried again after a day: the computer may have been busy.
TOO_LARGE = {"fault": "needs more than 1 GB of memory or 30 s"}
RETRIED_AFTER_S = 86_400.0
CHILD = "drake_navbench.inputs.descriptions.mesh_child"


def mesh_outlines(shapes: Sequence[Shape], to_base: Array) -> list[dict[str, Any]]:
    """Calls `mesh_child.outlines` in a limited process; to_base: (4, 4) of the shapes' frame."""
    return _read("outlines", [_asked(shape, to_base) for shape in shapes])


def mesh_sections(
    shapes: Sequence[Shape], bands: Sequence[Sequence[float]]
) -> list[dict[str, Any]]:
    """Calls `mesh_child.sections` in a limited process; bands: heights of cuts, m."""
    plain = [list(map(float, heights)) for heights in bands]
    return _read("sections", [_asked(shape, np.eye(4)) | {"bands": plain} for shape in shapes])


def mesh_files(shapes: Sequence[Shape]) -> list[str | None]:
    """Returns for each mesh a file that Drake can draw, unscaled; None for an unreadable mesh.

    The file is the mesh itself if it is a whole and small OBJ file, else one in the user's cache.
    """
    whole = [_is_small_obj(shape) for shape in shapes]
    plain = [not shape.submesh and not shape.is_centred for shape in shapes]
    wanted: list[dict[str, Any]] = [
        {"file": str(s.mesh), "submesh": s.submesh, "is_centred": s.is_centred} for s in shapes
    ]
    files: list[Path] = []
    for shape, entry, is_whole, is_plain in zip(shapes, wanted, whole, plain, strict=True):
        is_own = is_whole and is_plain and shape.mesh is not None
        files.append(Path(entry["file"]) if is_own else _cache_file("obj", entry, ".obj"))
    missing = {file: entry for file, entry in zip(files, wanted, strict=True) if not file.is_file()}
    _write_objs(missing)
    return [str(file.absolute()) if file.is_file() else None for file in files]


def _is_small_obj(shape: Shape) -> bool:
    if shape.mesh is None or shape.mesh.suffix.lower() != ".obj":
        return False
    return shape.mesh.is_file() and shape.mesh.stat().st_size <= MAX_DRAWN_BYTES


def _write_objs(wanted: Mapping[Path, dict[str, Any]]) -> None:
    """Writes meshes as OBJ files, each whole or not at all."""
    try:
        user_cache_folder().joinpath(FOLDER).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=user_cache_folder() / FOLDER) as folder:
            parts = {file: Path(folder) / file.name for file in wanted}
            requests = [entry | {"obj": str(parts[file])} for file, entry in wanted.items()]
            _read_now("write_objs", requests)
            for file, part in parts.items():
                if part.is_file():
                    part.replace(file)
    except OSError:
        return


def _asked(shape: Shape, to_base: Array) -> dict[str, Any]:
    transform = to_base @ shape.pose @ np.diag([*shape.size, 1.0])
    return {
        "file": str(shape.mesh),
        "submesh": shape.submesh,
        "is_centred": shape.is_centred,
        "transform": transform.round(9).tolist(),
    }


def _read(function: str, requests: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Returns an answer for each mesh: from the cache, or read now, all in one process."""
    files = [_cache_file(function, entry) for entry in requests]
    answers = [_cached(file) for file in files]
    missing = [index for index, answer in enumerate(answers) if answer is None]
    if missing:
        for index, answer in zip(
            missing, _read_now(function, [requests[i] for i in missing]), strict=True
        ):
            answers[index] = _explained(answer)
            if "fault" not in answer or answer == TOO_LARGE:
                _keep(files[index], answer)
    return [answer or {} for answer in answers]


def _read_now(function: str, requests: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Reads meshes together or, where that takes too much memory or time, one by one."""
    if not requests:
        return []
    try:
        return list(call_limited(f"{CHILD}:{function}", requests, "meshes"))
    except InputError:
        if len(requests) == 1:
            return [TOO_LARGE]
    half = len(requests) // 2
    return _read_now(function, requests[:half]) + _read_now(function, requests[half:])


def _explained(answer: dict[str, Any]) -> dict[str, Any]:
    fault = answer.get("fault", "")
    if "collada" in fault and ("No module" in fault or "not installed" in fault):
        return {"fault": f"needs the library pycollada: {HOW_TO_INSTALL}"}
    return answer


def _cache_file(function: str, entry: dict[str, Any], suffix: str = ".json") -> Path:
    try:
        digest = file_digest(Path(entry["file"]), max_bytes=MAX_MESH_BYTES)
    except InputError:
        digest = ""
    name = json.dumps([VERSION, function, digest, {**entry, "file": ""}])
    return user_cache_folder() / FOLDER / f"{sha256(name.encode()).hexdigest()}{suffix}"


def _cached(file: Path) -> dict[str, Any] | None:
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        age_s = time.time() - file.stat().st_mtime
    except (OSError, ValueError):
        return None
    if found == TOO_LARGE and age_s > RETRIED_AFTER_S:
        return None
    return found if isinstance(found, dict) else None


def _keep(file: Path, answer: dict[str, Any]) -> None:
    """Writes an answer into the cache, whole or not at all; ignores errors of writing."""
    with suppress(CannotBeWritten):
        write_text(file, json.dumps(answer))
