"""The messages between the pages of a studio and its workers; light to import, as pages are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array
from drake_navbench.nav2.patch import Place, patched

if TYPE_CHECKING:
    from drake_navbench.inputs.scenario import Scenario

SERVER = "controller_server"


class DrawnScenario(NamedTuple):
    """A scenario with its file's path or its name.

    content: as read from YAML. path: the file's, which may still have other content.
    """

    content: Mapping[str, Any]
    path: str

    def scenario(self) -> Scenario:
        """Returns the scenario; raises InputError with the loader's words."""
        from drake_navbench.inputs.scenario import scenario_in_file

        return scenario_in_file(dict(self.content), Path(self.path))


class Column(NamedTuple):
    """A column to drive.

    name: name of a preset, or of the plugin in a Nav2 file. file: path of the Nav2 file, '' for a
    preset. text: text of the file as it was read. changes: value by the name that the file or the
    preset uses; one of another node of the file is 'NODE/NAME', such as 'local_costmap/width'.
    """

    name: str
    file: str = ""
    text: str = ""
    changes: tuple[tuple[str, Any], ...] = ()

    @property
    def patched_text(self) -> str:
        """The text of the Nav2 file with the changes; raises InputError."""
        places: dict[Place | str, Any] = {
            name.replace("/", ".", 1) if "/" in name else f"{SERVER}.{self.name}.{name}": value
            for name, value in self.changes
        }
        return patched(self.text, places, Path(self.file))

    @property
    def argument(self) -> str:
        """The preset with the changes as `--controllers` takes it."""
        return ":".join([self.name, *(f"{name}={_written(v)}" for name, v in self.changes)])


class Checked(NamedTuple):
    """The check of a drawing: a line for each fault, and the plans from start to each goal."""

    faults: tuple[str, ...]
    plans: tuple[Array, ...] = ()
    outline: Array | None = None


class Driven(NamedTuple):
    """A trial that was driven, as its page shows it.

    poses: (N, 3) x m, y m, yaw rad. speeds: (N, 2) m/s, rad/s. plan: (M, 2) m. metrics: value by
    name. log: its file. took_s: wall-clock time in all. drive: the arguments of `drive_column`
    except the log. notes: lines from the loaders.
    """

    column: str
    outcome: str
    reason: str
    times_s: Array
    poses: Array
    speeds: Array
    plan: Array
    outline: Array
    metrics: Mapping[str, float]
    log: str
    took_s: float
    drive: tuple[DrawnScenario, Column, str]
    notes: tuple[str, ...] = ()


class MetricOf(NamedTuple):
    """A metric as the page shows it; better: 'higher', 'lower' or ''."""

    name: str
    title: str
    unit: str
    better: str


class Ground(NamedTuple):
    """A map to be drawn under everything: RGBA as (rows, columns) uint32, and its bounds, m."""

    image: NDArray[np.uint32]
    bounds: tuple[float, float, float, float]


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(_written, value))}]"
    return str(value)
