"""The runs in a studio's folder: their progress, their changes, and the pages to open."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.errors import InputError
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.logs.run_list import Run, run_folders, run_of
from drake_navbench.studio.open_folder import OpenFolder
from drake_navbench.typed_files.dotted_names import flattened
from drake_navbench.typed_files.typed_yaml import read_yaml

RESULTS = "results"
MAX_LINES = 6
MAX_PAGES = 8


class RunState(NamedTuple):
    """A run as its card shows it.

    done, total: trials; total is None if the manifest does not have it. pages: title and name of
    the pages to open. changed: lines on the parameters that differ from the previous run's.
    """

    path: Path
    run: Run
    done: int
    total: int | None
    is_running: bool
    can_resume: bool
    pages: tuple[tuple[str, str], ...]
    changed: tuple[str, ...]


def run_states(folder: OpenFolder) -> list[RunState]:
    """Returns the runs in a folder and in its folder `results`, the newest first."""
    places = [folder.root]
    results = folder.root / RESULTS
    if results.is_dir() and results.resolve().is_relative_to(folder.root):
        places.append(results)
    paths = [
        path
        for place in places
        for path in run_folders(place)
        if path.resolve().is_relative_to(folder.root)
    ]
    runs = sorted(((path, run_of(path)) for path in paths), key=lambda entry: entry[1].created_s)
    states = []
    before: Path | None = None
    for path, run in runs:
        states.append(_state(folder, path, run, before))
        before = path
    return states[::-1]


def _state(folder: OpenFolder, path: Path, run: Run, before: Path | None) -> RunState:
    manifest = _manifest(path)
    request = manifest.get("request")
    done = len(list(path.glob("trials/*/*/trial_*.parquet")))
    total = None
    if request is not None and not manifest.get("sweep"):
        count = int(request.get("trials") or 0)
        total = count * len(manifest.get("scenarios", ())) * len(manifest.get("controllers", ()))
    is_running = is_being_written(path)
    return RunState(
        path,
        run,
        done,
        total,
        is_running,
        request is not None and not is_running and (total is None or done < total),
        _pages(folder, path),
        () if before is None else parameter_differences(path, before),
    )


def is_being_written(path: Path) -> bool:
    """Returns whether a run holds the lock of a results folder."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(descriptor)
    return False


def parameter_differences(new: Path, old: Path) -> tuple[str, ...]:
    """Returns a line for each parameter in which the columns of a run differ from an older run's.

    Columns are matched by name; a variant `rpp:...` matches the older run's only column of `rpp`.
    """
    after, before = _columns(new), _columns(old)
    lines = []
    for name, values in after.items():
        base = name.partition(":")[0]
        alike = [n for n in before if n == name] or [
            n for n in before if n.partition(":")[0] == base
        ]
        if len(alike) != 1:
            continue
        olds = before[alike[0]]
        for key in sorted({*values, *olds}):
            if values.get(key) != olds.get(key):
                lines.append(
                    f"{base}: {key} {_value_text(olds.get(key))} → {_value_text(values.get(key))}"
                )
    if len(lines) > MAX_LINES:
        lines = [*lines[:MAX_LINES], f"and {len(lines) - MAX_LINES} more"]
    return tuple(lines)


def _columns(path: Path) -> dict[str, Mapping[str, Any]]:
    """Returns the resolved parameters of the columns of a run by dotted name."""
    found: dict[str, Mapping[str, Any]] = {}
    for name in _manifest(path).get("controllers", ()):
        try:
            data = read_yaml(path / "inputs" / "controllers" / f"{_file(name)}.yaml")
            found[name] = dict(flattened(data.get("parameters") or {}))
        except InputError:
            continue
    return found


def _file(name: str) -> str:
    from drake_navbench.logs.results import file_name

    return file_name(name)


def _manifest(path: Path) -> dict[str, Any]:
    try:
        return ResultsFolder(path).read_manifest()
    except InputError:
        return {}


def _pages(folder: OpenFolder, path: Path) -> tuple[tuple[str, str], ...]:
    files = [path / "report.html", *sorted((path / "replays").glob("*.html"))[:MAX_PAGES]]
    return tuple(
        ("report" if file.name == "report.html" else f"replay {file.stem}", folder.name_of(file))
        for file in files
        if file.is_file() and file.resolve().is_relative_to(folder.root)
    )


def _value_text(value: Any) -> str:
    return "none" if value is None else str(value)
