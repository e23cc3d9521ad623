"""Map files are read as Nav2's map server reads them; what is wrong is one line."""

import numpy as np
import pytest
from PIL import Image

from drake_navbench.errors import InputError, InputWarning
from drake_navbench.navigation.costmaps.map_file import load_map
from drake_navbench.navigation.costmaps.map_image import MapMode, occupancy_from_grey

FIELDS = {
    "image": "map.pgm",
    "resolution": 0.05,
    "origin": [-1.5, 2.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.25,
}

# Top row: occupied, unknown (p = 0.502); bottom row: both free (205 is p = 0.196).
PLAIN_PGM = "P2\n# a comment\n2 2\n255\n0 127\n254 205\n"


@pytest.fixture
def map_yaml(tmp_path):
    """Writes a map of the given fields and image file, and returns the path of its YAML file."""

    def write(*, content=PLAIN_PGM, without=None, **changes):
        fields = {**FIELDS, **changes}
        fields.pop(without, None)
        (tmp_path / "map.pgm").write_bytes(
            content if isinstance(content, bytes) else content.encode()
        )
        path = tmp_path / "map.yaml"
        path.write_text("".join(f"{name}: {value}\n" for name, value in fields.items()))
        return path

    return write


def occupancy(grey, *, alpha=255, mode=MapMode.TRINARY, negate=False, occupied=0.65, free=0.25):
    grey = np.array([grey], dtype=np.uint8)
    return occupancy_from_grey(
        grey,
        np.broadcast_to(np.array(alpha, dtype=np.uint8), grey.shape),
        mode=mode,
        negate=negate,
        occupied_thresh=occupied,
        free_thresh=free,
    )[0].tolist()


def error_of(path):
    with pytest.raises(InputError) as caught:
        load_map(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(path))
    return message


def test_map_is_read_with_its_top_row_at_the_highest_y(map_yaml):
    loaded = load_map(map_yaml())
    np.testing.assert_array_equal(loaded.occupancy, [[0, 0], [100, -1]])
    assert loaded.occupancy.dtype == np.int8
    assert (loaded.origin_x, loaded.origin_y) == (-1.5, 2.0)


def test_fields_that_the_map_server_does_not_read_are_told_and_change_nothing(map_yaml):
    # Nav2's own test map has a map_type.
    with pytest.warns(InputWarning, match=r"map.yaml: map_type: has no effect, Nav2's map server"):
        loaded = load_map(map_yaml(map_type="occupancy"))
    np.testing.assert_array_equal(loaded.occupancy, load_map(map_yaml()).occupancy)
    with pytest.warns(InputWarning, match=r"modus: has no effect.*; did you mean 'mode'\?"):
        load_map(map_yaml(modus="raw"))


def test_cells_of_five_metres_are_told(map_yaml):
    with pytest.warns(InputWarning, match=r"resolution: a cell is 5 m wide; is it in metres\?"):
        load_map(map_yaml(resolution=5.0))


def test_resolution_is_that_of_the_message(map_yaml):
    assert load_map(map_yaml()).resolution == 0.05000000074505806


@pytest.mark.parametrize("text", ["5e-2", "'0.05'", ".05", "+0.05"])
def test_numbers_are_those_of_yaml_cpp(map_yaml, text):
    path = map_yaml()
    path.write_text(path.read_text().replace("resolution: 0.05", f"resolution: {text}"))
    assert load_map(path).resolution == load_map(map_yaml()).resolution


def test_loaded_map_cannot_be_changed(map_yaml):
    with pytest.raises(ValueError, match="read-only"):
        load_map(map_yaml()).occupancy[0, 0] = 1


def test_binary_pgm_reads_like_a_plain_one(map_yaml):
    loaded = load_map(map_yaml(content=b"P5\n2 2\n255\n" + bytes([0, 127, 254, 205])))
    np.testing.assert_array_equal(loaded.occupancy, [[0, 0], [100, -1]])


def test_image_path_is_relative_to_the_yaml_file_and_may_be_absolute(map_yaml, tmp_path):
    folder = tmp_path / "images"
    folder.mkdir()
    (folder / "other.pgm").write_text(PLAIN_PGM)
    for image in ("images/other.pgm", folder / "other.pgm"):
        assert load_map(map_yaml(image=image)).occupancy.shape == (2, 2)


@pytest.mark.parametrize(
    ("grey", "expected"),
    # p = 1 - grey / 255: 1, 0.651, 0.647, 0.251, 0.247, 0
    [(0, 100), (89, 100), (90, -1), (191, -1), (192, 0), (255, 0)],
)
def test_trinary_cuts_at_both_thresholds(grey, expected):
    assert occupancy([grey]) == [expected]


def test_values_right_at_a_threshold_count():
    # 51 / 255 = 0.2 and 204 / 255 = 0.8 in float32 as well.
    assert occupancy([51, 204], negate=True, free=0.2, occupied=0.8) == [0, 100]


def test_equal_thresholds_leave_nothing_unknown():
    assert occupancy(list(range(256)), free=0.5, occupied=0.5).count(-1) == 0


def test_negate_swaps_black_and_white():
    assert occupancy([0, 255], negate=True) == [0, 100]


def test_scale_grades_between_the_thresholds():
    # p = 0, 0.2, 0.4, 0.6, 1 from grey 255, 204, 153, 102, 0; thresholds 0 and 1.
    grey = [255, 204, 153, 102, 0]
    assert occupancy(grey, mode=MapMode.SCALE, free=0.0, occupied=1.0) == [0, 20, 40, 60, 100]
    # Thresholds 0.2 and 0.6: (0.4 - 0.2) / 0.4 = 50%.
    assert occupancy(grey, mode=MapMode.SCALE, free=0.2, occupied=0.6) == [0, 0, 50, 100, 100]


def test_raw_takes_grey_as_it_is_and_knows_no_negation():
    for negate in (False, True):
        grey = [0, 1, 100, 101, 255]
        assert occupancy(grey, mode=MapMode.RAW, negate=negate) == [0, 1, 100, -1, -1]


def test_pixels_that_are_not_opaque_are_unknown_except_in_raw():
    assert occupancy([0, 0, 255], alpha=[255, 254, 0]) == [100, -1, -1]
    assert occupancy([0, 0], alpha=[255, 0], mode=MapMode.SCALE) == [100, -1]
    assert occupancy([7], alpha=[0], mode=MapMode.RAW) == [7]


@pytest.mark.parametrize("mode", ["trinary", "Trinary", "SCALE", "raw"])
def test_mode_may_be_given_in_any_case(map_yaml, mode):
    assert load_map(map_yaml(mode=mode)).occupancy.shape == (2, 2)


@pytest.mark.parametrize("negate", [1, "true"])
def test_negate_may_be_a_number_or_a_flag(map_yaml, negate):
    np.testing.assert_array_equal(load_map(map_yaml(negate=negate)).occupancy[1], [0, -1])


def test_png_with_transparency_and_colour(map_yaml, tmp_path):
    pixels = np.array(
        [[[0, 0, 0, 255], [0, 0, 0, 100]], [[255, 255, 255, 255], [0, 255, 0, 255]]], dtype=np.uint8
    )
    Image.fromarray(pixels).save(tmp_path / "map.png")
    # Pure green is grey 0.715158 * 255 = 182: p = 0.286, unknown.
    loaded = load_map(map_yaml(image="map.png"))
    np.testing.assert_array_equal(loaded.occupancy, [[0, -1], [100, -1]])


@pytest.mark.parametrize("field", sorted(FIELDS))
def test_missing_field_is_named(map_yaml, field):
    message = error_of(map_yaml(without=field))
    assert field in message
    assert "missing" in message


@pytest.mark.parametrize(
    ("field", "value", "expected"),
    [
        ("resolution", 0, "expected 0.001 to 100"),
        ("resolution", "fine", "number"),
        ("origin", [0, 0], "origin"),
        ("occupied_thresh", 1.5, "less than or equal to 1"),
        ("negate", 2, "expected 0, 1, true or false"),
        ("mode", "ternary", "'trinary', 'scale' or 'raw'"),
    ],
)
def test_wrong_value_is_named(map_yaml, field, value, expected):
    path = map_yaml(**{field: value})
    message = error_of(path)
    line = next(n for n, text in enumerate(path.read_text().split("\n"), 1) if field in text)
    assert message.startswith(f"{path}, line {line}: {field}")
    assert expected in message


def test_of_overlapping_thresholds_the_free_one_counts_as_in_nav2(map_yaml):
    path = map_yaml(free_thresh=0.7)
    with pytest.warns(InputWarning, match=r"free_thresh 0\.7 exceeds occupied_thresh 0\.65"):
        load_map(path)
    # Shares of 0, 0.686 and 1: free, claimed by both, occupied.
    grey = np.array([[255, 80, 0]], dtype=np.uint8)
    occupancy = occupancy_from_grey(
        grey,
        np.full_like(grey, 255),
        mode=MapMode.SCALE,
        negate=False,
        occupied_thresh=0.65,
        free_thresh=0.7,
    )
    assert occupancy.tolist() == [[0, 0, 100]]


def test_missing_image_is_named_and_one_that_differs_in_case_alone(map_yaml):
    path = map_yaml(image="gone.pgm")
    message = error_of(path)
    assert "image: no such file" in message
    assert message.endswith("gone.pgm'")
    (path.parent / "gone.PGM").touch()
    assert error_of(path).endswith("gone.pgm'; gone.PGM is there: write its name so")


@pytest.mark.parametrize(
    "content", ["not an image", "", "P5\n2 2\n255\n", "P2\n2 2\n255\n1 2 x y\n", "P2\n0 0\n255\n"]
)
def test_broken_image_is_refused(map_yaml, content):
    assert "image: cannot be read" in error_of(map_yaml(content=content))


def test_image_of_more_than_eight_bits_is_refused(map_yaml):
    message = error_of(map_yaml(content="P2\n1 1\n65535\n40000\n"))
    assert "expected 8 bits a channel" in message


def test_missing_yaml_file_is_named(tmp_path):
    assert "cannot be read" in error_of(tmp_path / "none.yaml")


@pytest.mark.parametrize("size", [(6000, 5000), (20_000, 5000)])
def test_image_of_too_many_pixels_is_refused_unread(map_yaml, tmp_path, size):
    # The larger one is beyond what Pillow itself warns of.
    Image.new("1", size).save(tmp_path / "map.png")
    message = error_of(map_yaml(image="map.png"))
    assert "are too many, expected at most" in message


def test_map_that_reaches_beyond_all_bounds_is_refused(map_yaml):
    message = error_of(map_yaml(origin=[9999.95, 0.0, 0.0]))
    assert "expected all of it within 10000 m" in message
