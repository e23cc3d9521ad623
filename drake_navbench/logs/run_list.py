"""The results folders in a folder, one line each."""

from __future__ import annotations

import json
import math
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.errors import InputError, printable
from drake_navbench.logs.results import ResultsFolder

TAGS = "tags"
# The most characters of a line on a results folder.
MOST_SHOWN = 120


class Run(NamedTuple):
    """The line on a results folder. created: its beginning in local time, '' if unknown."""

    name: str
    created: str
    tags: tuple[str, ...]
    what: str
    verdict: str

    @property
    def created_s(self) -> float:
        """The beginning as seconds since 1970; minus infinity if unknown."""
        try:
            return datetime.fromisoformat(self.created).timestamp()
        except ValueError:
            return -math.inf


def run_folders(folder: Path) -> list[Path]:
    """Returns the results folders directly below a folder."""
    return sorted(path for path in folder.iterdir() if (path / "manifest.json").is_file())


def run_of(path: Path) -> Run:
    """Returns the line on a results folder; for an unreadable one it says why."""
    try:
        manifest = ResultsFolder(path).read_manifest()
    except InputError as error:
        return Run(path.name, "", (), f"cannot be read: {error}", "")
    scenarios, columns = manifest.get("scenarios", []), manifest.get("controllers", [])
    trials = len(list(path.glob("trials/*/*/trial_*.parquet")))
    told = f"{trials} trial{'s' * (trials != 1)}"
    where = f"{len(scenarios)} scenarios" if len(scenarios) > 3 else ", ".join(scenarios)
    return Run(
        path.name,
        str(manifest.get("created", "")),
        tags_of(path),
        printable(f"{', '.join(columns)} in {where}; {told}", MOST_SHOWN),
        str(manifest.get("verdict", "")),
    )


def tags_path(path: Path) -> Path:
    """Returns the file of a results folder's tags."""
    return path / f"{TAGS}.json"


def tags_of(path: Path) -> tuple[str, ...]:
    """Returns the tags of a results folder; none where their file cannot be read."""
    try:
        found: Any = json.loads(tags_path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ()
    return tuple(tag for tag in found if isinstance(tag, str)) if isinstance(found, list) else ()
