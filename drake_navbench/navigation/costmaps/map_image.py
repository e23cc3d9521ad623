"""The image of a map, and the occupancy that its grey means.

Images are read by Pillow: PGM (P2 and P5), PNG, BMP and whatever else it knows, 8 bits a channel.
Source: nav2_map_server (map_io).
"""

from __future__ import annotations

import warnings
from enum import StrEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from drake_navbench.errors import InputError
from drake_navbench.navigation.costmaps.grid_size import MAX_GRID_CELLS, require_grid_size
from drake_navbench.typed_files.input_file import (
    LFS_POINTER,
    other_case,
    read_head,
    require_fetched,
)

UNKNOWN = -1
OCCUPIED = 100
OPAQUE = 255
MAX_GREY = 255
# ImageMagick's weights of red, green and blue (Rec. 709), by which Nav2 makes colours grey.
LUMA = np.array([0.212656, 0.715158, 0.072186])
GREY_MODES = ("1", "L", "LA")
COLOUR_MODES = ("P", "PA", "RGB", "RGBA")


class MapMode(StrEnum):
    """The rule that turns grey into occupancy."""

    TRINARY = "trinary"
    SCALE = "scale"
    RAW = "raw"


def occupancy_from_grey(
    grey: NDArray[np.uint8],
    alpha: NDArray[np.uint8],
    *,
    mode: MapMode,
    negate: bool,
    occupied_thresh: float,
    free_thresh: float,
) -> NDArray[np.int8]:
    """Returns the occupancy of each pixel, int8, of the shape of `grey` and `alpha`.

    With p = 1 - grey / 255, or grey / 255 where `negate`, in float32: p <= free_thresh is free (0),
    else p >= occupied_thresh is occupied (100); a value between is unknown (-1), or in mode scale
    round(100 (p - free_thresh) / (occupied_thresh - free_thresh)). Pixels that are not opaque are
    unknown. In mode raw the grey value itself counts, unknown above 100.
    """
    if mode == MapMode.RAW:
        return np.where(grey <= OCCUPIED, grey.astype(np.int16), UNKNOWN).astype(np.int8)
    share = grey.astype(np.float32) / np.float32(MAX_GREY)
    if not negate:
        share = np.float32(1.0) - share
    low, high = np.float32(free_thresh), np.float32(occupied_thresh)
    occupancy = np.full(grey.shape, UNKNOWN, dtype=np.int8)
    if mode == MapMode.SCALE:
        between = (share > low) & (share < high)
        scaled = (share[between] - low) / np.float32(occupied_thresh - free_thresh)
        occupancy[between] = np.floor(scaled * np.float32(OCCUPIED) + np.float32(0.5))
    occupancy[share >= high] = OCCUPIED
    occupancy[share <= low] = 0
    occupancy[alpha < OPAQUE] = UNKNOWN
    return occupancy


def read_image(path: Path, named_by: str) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Returns grey and alpha of an image, (rows, columns) uint8 each, top row first."""
    if not path.is_file():
        other = other_case(path)
        hint = f"; {other.name} is there: write its name so" if other else ""
        raise InputError(f"{named_by}: image: no such file, got {str(path)!r}{hint}")
    require_fetched(path, read_head(path, len(LFS_POINTER)))
    try:
        # Pillow warns of images beyond a size that is refused here in any case.
        bomb = Image.DecompressionBombWarning
        with warnings.catch_warnings(action="error", category=bomb), Image.open(path) as image:
            require_grid_size(f"{named_by}: image", *image.size)
            if image.mode not in GREY_MODES + COLOUR_MODES:
                raise InputError(
                    f"{named_by}: image: expected 8 bits a channel, "
                    f"got Pillow's mode {image.mode!r} in {str(path)!r}"
                )
            pixels = np.asarray(image.convert("LA" if image.mode in GREY_MODES else "RGBA"))
    except (Image.DecompressionBombError, bomb) as error:
        raise InputError(
            f"{named_by}: image: more than {Image.MAX_IMAGE_PIXELS:.3g} pixels are too many, "
            f"expected at most {MAX_GRID_CELLS:.3g}"
        ) from error
    # Pillow reports broken files by errors of all these types.
    except (OSError, SyntaxError, ValueError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{named_by}: image: cannot be read: {reason}") from error
    colour, alpha = pixels[..., :-1], pixels[..., -1]
    if colour.shape[-1] == 1:
        return colour[..., 0], alpha
    # Row by row: as floats the whole image would take 24 times its size.
    return np.stack([np.rint(row @ LUMA).astype(np.uint8) for row in colour]), alpha
