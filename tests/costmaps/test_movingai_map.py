"""MovingAI's grids are maps as well, alone or as the image of a map file."""

from __future__ import annotations

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.navigation.costmaps.map_file import MOVINGAI_RESOLUTION_M, load_map
from drake_navbench.navigation.costmaps.map_image import OCCUPIED

TEXT = """type octile
height 3
width 4
map
.@T.
GSWO
....
"""


def write(folder, text=TEXT):
    path = folder / "arena.map"
    path.write_text(text)
    return path


def test_ground_and_swamp_are_free_all_else_is_occupied(tmp_path):
    grid = load_map(write(tmp_path))
    assert grid.bounds == pytest.approx((0.0, 0.0, 4 * 0.2, 3 * 0.2))
    assert grid.resolution == MOVINGAI_RESOLUTION_M
    full = OCCUPIED
    # The lowest row, which is the last of the file, comes first.
    np.testing.assert_array_equal(
        grid.occupancy, [[0, 0, 0, 0], [0, 0, full, full], [0, full, full, 0]]
    )


def test_a_map_file_gives_it_resolution_and_place(tmp_path):
    write(tmp_path)
    fields = "image: arena.map\nresolution: 0.5\norigin: [-1.0, 2.0, 0.0]\nnegate: 0\n"
    path = tmp_path / "arena.yaml"
    path.write_text(f"{fields}occupied_thresh: 0.65\nfree_thresh: 0.196\n")
    grid = load_map(path)
    assert grid.bounds == pytest.approx((-1.0, 2.0, 1.0, 3.5))
    assert (grid.occupancy == OCCUPIED).sum() == 4


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("type octile\n", "", "begins with the lines type, height, width, map"),
        ("height 3", "height three", "line 2: height: expected a whole number"),
        ("height 3", "height 4", "expected 4 rows below line 4, got 3"),
        ("GSWO", "GSW", "line 6: expected 4 cells, got 3"),
        ("GSWO", "GSWx", "line 6: cell 4 is 'x'"),
        ("width 4", "width 99999999", "are too many"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(tmp_path, old, new, reason):
    with pytest.raises(InputError, match=reason) as caught:
        load_map(write(tmp_path, TEXT.replace(old, new)))
    assert str(caught.value).startswith(str(tmp_path / "arena.map"))
