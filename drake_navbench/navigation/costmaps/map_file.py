"""Reads maps: those of Nav2's map_server, a YAML file beside an image, and MovingAI's grids.

Source: nav2_map_server (map_io).
"""

from __future__ import annotations

import os
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from drake_navbench.errors import InputError, InputWarning, nearest_name_hint
from drake_navbench.kernels.grid import Grid, cell_at
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.navigation.costmaps.map_image import (
    MAX_GREY,
    OCCUPIED,
    UNKNOWN,
    MapMode,
    occupancy_from_grey,
    read_image,
)
from drake_navbench.navigation.costmaps.movingai_map import SUFFIX as MOVINGAI_SUFFIX
from drake_navbench.navigation.costmaps.movingai_map import read_movingai_map
from drake_navbench.navigation.costmaps.turned_map import turned_along_axes
from drake_navbench.typed_files.file_kinds import MAP, require_kind
from drake_navbench.typed_files.quantities import MAX_LENGTH_M, Angle, CellSize, Length
from drake_navbench.typed_files.typed_yaml import (
    FrozenModel,
    parse_yaml,
    place_in,
    read_text,
    validate,
)
from drake_navbench.typed_files.yaml_loader import DECIMAL

# The grey of unknown cells as map savers write it, and a free_thresh with which it stays unknown.
SAVED_UNKNOWN, SAVED_FREE_THRESH = 205, 0.196
# The occupancy, as a share, up to which mode scale leaves a cell as good as free.
NEARLY_FREE = 0.01
# A smaller share of such cells is not told: a drawing may have that grey by chance.
LEAST_SHARE = 0.01
# No map of a robot's has wider cells, m.
WIDE_CELL_M = 1.0
IMAGE_SUFFIXES = (".pgm", ".png", ".bmp", ".jpg", ".jpeg", ".gif", ".tif", ".tiff")
# The number of a wrong file's fields that its error names.
MOST_FIELDS_NAMED = 3
# MovingAI's maps do not tell how large a cell is: corridors of a few cells fit a small robot, m.
MOVINGAI_RESOLUTION_M = 0.2


class MapMetadata(FrozenModel):
    """The YAML file of a map."""

    image: str = Field(min_length=1, description="Path of the image from this file's folder.")
    resolution: CellSize = Field(description="Edge length of a pixel [m].")
    origin: tuple[Length, Length, Angle] = Field(
        description="Pose of the lower left corner of the lower left pixel: x [m], y [m], yaw "
        "[rad]."
    )
    negate: bool = Field(description="Whether white means occupied: 0 or 1.")
    occupied_thresh: float = Field(
        ge=0.0,
        le=1.0,
        description="Occupancy (darkness of the pixel, 0 to 1) from which a cell is occupied.",
    )
    free_thresh: float = Field(ge=0.0, le=1.0, description="Occupancy up to which a cell is free.")
    mode: MapMode = Field(
        MapMode.TRINARY, description="How grey is read: trinary, scale or raw; upper or lower case."
    )

    @field_validator("resolution", "occupied_thresh", "free_thresh", mode="before")
    @classmethod
    def _accept_quotes(cls, value: Any) -> Any:
        return _unquoted(value)

    @field_validator("origin", mode="before")
    @classmethod
    def _accept_quotes_within(cls, value: Any) -> Any:
        return tuple(map(_unquoted, value)) if isinstance(value, list) else value

    @field_validator("negate", mode="before")
    @classmethod
    def _accept_zero_and_one(cls, value: Any) -> bool:
        number = _unquoted(value)
        if number not in (0, 1):
            raise ValueError("expected 0, 1, true or false")
        return bool(number)

    @field_validator("mode", mode="before")
    @classmethod
    def _ignore_case(cls, value: Any) -> Any:
        return value.lower() if isinstance(value, str) else value


def _unquoted(value: Any) -> Any:
    """Returns the number in a quoted text, as yaml-cpp reads it; any other value as it is."""
    is_number = isinstance(value, str) and re.fullmatch(DECIMAL, value)
    return float(value) if is_number else value


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyMap(Immutable):
    """A map as Nav2's map server publishes it.

    occupancy: (rows, columns) int8, `[row = y, column = x]`, read-only: -1 unknown, else 0 to 100.
    resolution: edge of a cell, m, rounded to float32 as in the message.
    origin_x, origin_y: lower left corner of cell (0, 0), m; the grid lies along the axes.
    files: its sources, the YAML file and the image.
    """

    occupancy: NDArray[np.int8]
    resolution: float
    origin_x: float
    origin_y: float
    files: tuple[Path, ...] = ()

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """min_x, min_y, max_x, max_y of the grid, m."""
        rows, columns = self.occupancy.shape
        right = self.origin_x + columns * self.resolution
        return self.origin_x, self.origin_y, right, self.origin_y + rows * self.resolution

    @property
    def frame(self) -> tuple[float, float, float]:
        """The cells' geometry: origin_x m, origin_y m, resolution m, as a `Grid` takes them."""
        return float(self.origin_x), float(self.origin_y), float(self.resolution)

    @property
    def is_occupied(self) -> NDArray[np.bool_]:
        """(rows, columns): the cells that an obstacle fills."""
        return self.occupancy == OCCUPIED

    @property
    def is_unknown(self) -> NDArray[np.bool_]:
        """(rows, columns): the cells of which nothing is known."""
        return self.occupancy == UNKNOWN

    def value_at(self, position: NDArray[np.float64]) -> int | None:
        """Returns the occupancy of the cell that holds (2,) m; None off the map."""
        grid = Grid(self.occupancy, *self.frame)
        column, row = cell_at(grid, float(position[0]), float(position[1]))
        return None if column < 0 else int(self.occupancy[row, column])


def load_map(path: str | Path, *, as_saved: bool = False) -> OccupancyMap:
    """Returns the map that a YAML file describes, or that a MovingAI file is.

    as_saved: cells that the map's saver left unknown stay unknown, even if free_thresh or the mode
    scale makes them free. (Up to 2025, Nav2 saved maps with such a free_thresh.) Without as_saved
    they are free, with an InputWarning.

    A map with a yaw is turned onto a grid along the axes, with an InputWarning: Nav2's costmaps
    take no notice of a yaw. A MovingAI file has its lower left corner at (0, 0) and cells of
    MOVINGAI_RESOLUTION_M. Raises InputError, one line a fault, where the file or its image cannot
    be read, or a field is missing or out of range. Fields that Nav2's map server does not read,
    such as `map_type`, are left out with an InputWarning; overlapping thresholds give one, too.
    """
    # Unlike Path's, it leaves a '~' alone that is nobody's.
    path = Path(os.path.expanduser(path))
    if path.suffix == MOVINGAI_SUFFIX:
        cells = _read_only(read_movingai_map(path, occupied=OCCUPIED)[::-1])
        return OccupancyMap(cells, MOVINGAI_RESOLUTION_M, 0.0, 0.0, files=(path,))
    if path.suffix.lower() in IMAGE_SUFFIXES:
        raise _image_fault(path)
    text = read_text(path)
    metadata = _metadata_of(path, text)
    if as_saved and metadata.mode == MapMode.TRINARY and _frees_unknown(metadata):
        metadata = metadata.model_copy(update={"free_thresh": SAVED_FREE_THRESH})
    named_by = place_in(text, str(path), ["image"])
    image = _image_of(path, metadata.image)
    # The top row of an image is the one with the highest y.
    occupancy = _image_occupancy(image, metadata, named_by, path, as_saved)[::-1]
    resolution = float(np.float32(metadata.resolution))
    origin_x, origin_y, yaw = metadata.origin
    if yaw != 0.0:
        warning = (
            f"{path}: origin: the map is turned by its yaw, {yaw:g} rad; Nav2's costmaps ignore it"
        )
        warnings.warn(warning, InputWarning, stacklevel=2)
        occupancy, origin_x, origin_y = turned_along_axes(
            occupancy,
            resolution=resolution,
            origin=metadata.origin,
            outside=UNKNOWN,
            source=f"{path}: origin: turned by {yaw:g} rad",
        )
    cells = _read_only(occupancy)
    grid = OccupancyMap(cells, resolution, origin_x, origin_y, files=(path, image))
    if max(map(abs, grid.bounds)) > MAX_LENGTH_M:
        raise InputError(
            f"{path}: origin and resolution: the map covers {list(grid.bounds)}, expected all of "
            f"it within {MAX_LENGTH_M:g} m of the frame's origin"
        )
    return grid


def _metadata_of(path: Path, text: str) -> MapMetadata:
    """Returns the fields of a map's YAML file, with InputWarnings of those that are odd."""
    fields = parse_yaml(text, str(path))
    require_kind(fields, MAP, path)
    if not fields.keys() & MapMetadata.model_fields.keys():
        names = ", ".join(map(str, list(fields)[:MOST_FIELDS_NAMED])) or "nothing"
        raise InputError(
            f"{path}: is no map file; expected image, resolution and origin, found {names}"
        )
    for name in [name for name in fields if name not in MapMetadata.model_fields]:
        del fields[name]
        hint = nearest_name_hint(name, MapMetadata.model_fields)
        warning = f"{path}: {name}: has no effect, Nav2's map server reads no such field{hint}"
        warnings.warn(warning, InputWarning, stacklevel=3)
    metadata = validate(MapMetadata, fields, str(path), text)
    if metadata.resolution > WIDE_CELL_M:
        warning = f"{path}: resolution: a cell is {metadata.resolution:g} m wide; is it in metres?"
        warnings.warn(warning, InputWarning, stacklevel=3)
    if metadata.free_thresh > metadata.occupied_thresh:
        warning = (
            f"{path}: free_thresh {metadata.free_thresh} exceeds occupied_thresh "
            f"{metadata.occupied_thresh}; a grey that both claim is free, as in Nav2 from Jazzy on"
        )
        warnings.warn(warning, InputWarning, stacklevel=3)
    return metadata


def _image_fault(path: Path) -> InputError:
    """Returns the error for an image given as a map, which names the map's YAML file."""
    beside = [path.with_suffix(suffix) for suffix in (".yaml", ".yml")]
    found = next((file.name for file in beside if file.is_file()), None)
    wanted = f"{found} beside it" if found else "a YAML file with image, resolution and origin"
    return InputError(f"{path}: is an image; expected the map's file that names it: {wanted}")


def _image_of(path: Path, named: str) -> Path:
    """Returns the path of a map's image.

    Where an absolute path does not exist, it is the image of that name beside the map, with a
    warning.
    """
    image = path.parent / named
    beside = path.parent / Path(named).name
    if Path(named).is_absolute() and not image.is_file() and beside.is_file():
        warning = f"{path}: image: {image}: no such file; {beside.name} beside it is taken"
        warnings.warn(warning, InputWarning, stacklevel=3)
        return beside
    return image


def _image_occupancy(
    image: Path, metadata: MapMetadata, named_by: str, path: Path, as_saved: bool
) -> NDArray[np.int8]:
    """Returns the occupancy of a map's image, top row first.

    The image may be a MovingAI file, which holds occupancies. named_by: the place that names the
    image, for errors. path: the map's file, for warnings. as_saved: as in `load_map`.
    """
    if image.suffix == MOVINGAI_SUFFIX:
        return read_movingai_map(image, occupied=OCCUPIED)
    grey, alpha = read_image(image, named_by)
    occupancy = occupancy_from_grey(
        grey,
        alpha,
        mode=metadata.mode,
        negate=metadata.negate,
        occupied_thresh=metadata.occupied_thresh,
        free_thresh=metadata.free_thresh,
    )
    is_unknown = grey == SAVED_UNKNOWN
    share = float(np.mean(is_unknown))
    is_scaled = metadata.mode == MapMode.SCALE
    if share < LEAST_SHARE or metadata.negate:
        return occupancy
    if is_scaled and as_saved:
        occupancy[is_unknown] = UNKNOWN
    elif _frees_unknown(metadata):
        field = "mode scale" if is_scaled else f"free_thresh {metadata.free_thresh:g}"
        cure = "in mode trinary" if is_scaled else f"with free_thresh: {SAVED_FREE_THRESH}"
        warning = (
            f"{path}: {field} makes the grey of unknown cells, {share:.0%} of the map, free, as in "
            f"Nav2; they stay unknown {cure}"
        )
        warnings.warn(warning, InputWarning, stacklevel=3)
    return occupancy


def _frees_unknown(metadata: MapMetadata) -> bool:
    """Tells whether the grey that map savers write for unknown cells is free, or scaled to 1%."""
    above = 1.0 - SAVED_UNKNOWN / MAX_GREY - metadata.free_thresh
    if metadata.mode == MapMode.SCALE:
        return above <= NEARLY_FREE * (metadata.occupied_thresh - metadata.free_thresh)
    return above <= 0.0 and metadata.mode == MapMode.TRINARY and not metadata.negate


def _read_only(cells: NDArray[np.int8]) -> NDArray[np.int8]:
    cells = np.ascontiguousarray(cells)
    cells.flags.writeable = False
    return cells
