"""The distance from an outline to edges and discs is exact, and 0 where they overlap."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.kernels.outline_distance import outline_to_circles, outline_to_edges

SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
FAR = 100.0


def distance(*edges, outline=SQUARE, limit=FAR) -> float:
    return outline_to_edges(outline, np.array(edges, dtype=float).reshape(-1, 4), limit)


@pytest.mark.parametrize(
    ("edge", "expected"),
    [
        ((3.0, -5.0, 3.0, 5.0), 2.0),  # beside a side
        ((2.0, 2.0, 5.0, 2.0), np.sqrt(2.0)),  # from corner to corner
        ((0.0, 3.0, 3.0, 0.0), np.sqrt(2.0) * 0.5),  # x + y = 3 passes the corner (1, 1)
        ((-5.0, 0.0, 5.0, 0.0), 0.0),  # right through
        ((0.2, 0.1, 0.3, 0.1), 0.0),  # wholly inside
        ((1.0, 0.0, 4.0, 0.0), 0.0),  # touching
    ],
)
def test_one_edge_is_at_its_distance(edge, expected):
    assert distance(edge) == pytest.approx(expected)


def test_the_nearest_of_several_counts_whatever_their_order():
    near, far = (3.0, -1.0, 3.0, 1.0), (0.0, 6.0, 1.0, 6.0)
    assert distance(near, far) == distance(far, near) == pytest.approx(2.0)


def test_beyond_the_limit_and_without_edges_it_is_infinite():
    assert distance((3.0, -1.0, 3.0, 1.0), limit=1.9) == np.inf
    assert distance() == np.inf


coordinates = st.floats(-4.0, 4.0).map(lambda x: round(x, 3))


@given(st.lists(st.tuples(*[coordinates] * 4), min_size=1, max_size=6))
def test_it_agrees_with_shapely(edges):
    area = shapely.Polygon(SQUARE)
    expected = min(area.distance(shapely.LineString(np.reshape(e, (2, 2)))) for e in edges)
    assert distance(*edges) == pytest.approx(expected, abs=1e-9)


@given(st.tuples(coordinates, coordinates, st.floats(0.0, 2.0)))
def test_a_disc_is_as_far_as_its_centre_less_its_radius(disc):
    x, y, radius = disc
    expected = max(shapely.Polygon(SQUARE).distance(shapely.Point(x, y)) - radius, 0.0)
    assert outline_to_circles(SQUARE, np.array([disc]), FAR) == pytest.approx(expected, abs=1e-9)


def test_the_nearest_disc_within_the_limit_counts():
    discs = np.array([[4.0, 0.0, 1.0], [-9.0, 0.0, 0.5], [0.0, 2.5, 0.25]])
    # Gaps of 2, 7.5 and 1.25 m.
    assert outline_to_circles(SQUARE, discs, FAR) == pytest.approx(1.25)
    assert outline_to_circles(SQUARE, discs, 1.2) == np.inf
    assert outline_to_circles(SQUARE, discs[:0], FAR) == np.inf
