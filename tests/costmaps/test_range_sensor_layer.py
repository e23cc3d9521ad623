"""Nav2's layer of range sensors: what it makes of readings over several cycles."""

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.robot import Robot
from drake_navbench.kernels.grid import FREE, LETHAL, NO_INFORMATION, cost_at
from drake_navbench.navigation.costmaps.costmap_settings import LocalCostmapSettings
from drake_navbench.navigation.costmaps.layered_costmap import local_layers
from drake_navbench.navigation.costmaps.range_reading import RangeReading
from drake_navbench.typed_files.typed_yaml import validate

FOOTPRINT = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
SONAR = "nav2_costmap_2d::RangeSensorLayer"


def layers_of(**parameters):
    """Returns layers of 60 x 60 cells of 0.1 m: range sensors alone, over unknown cells."""
    block = {"plugin": SONAR, "topics": ["sonar"], **parameters}
    costmap = {"width": 6, "height": 6, "resolution": 0.1, "track_unknown_space": True}
    settings = validate(
        LocalCostmapSettings, {**costmap, "plugins": ["sonar"], "sonar": block}, "costmap"
    )
    return local_layers(settings, lidar=LidarSettings(), footprint=FOOTPRINT)


def reading(range_m, time_s=0.0, *, range_min_m=0.1, range_max_m=2.0):
    """Returns a reading along x of a sensor at the origin."""
    return RangeReading(time_s, np.zeros(3), range_m, range_min_m, range_max_m, 0.4)


def seen(layers, *cycles):
    """Returns the costmaps of cycles of 0.2 s, each a list of readings, by a robot that stands."""
    state, costmaps = layers.initial_state(), []
    for count, readings in enumerate(cycles):
        state = layers.updated(
            state,
            scan=None,
            pose=np.zeros(3),
            time_s=0.2 * count,
            ranges={"sonar": tuple(readings)},
        )
        costmaps.append(state.costmap)
    return costmaps


def ahead(costmap, x_m):
    """Returns the cost on the axis of the sensor."""
    return cost_at(costmap.grid, x_m, 0.05)


def test_a_reading_marks_where_it_points_and_frees_what_is_before():
    (costmap,) = seen(layers_of(), [reading(1.03)])
    assert ahead(costmap, 1.03) == LETHAL
    assert ahead(costmap, 0.55) == FREE
    assert ahead(costmap, 1.55) == NO_INFORMATION


def test_every_reading_since_the_last_cycle_counts_once():
    # A cell 1.55 m ahead: one reading of 1.95 m leaves it at 0.2 < p < 0.5, three free it. The
    # first cycle takes one; in the second one two new ones come, and the old one again.
    one = reading(1.95, 0.0)
    between = [reading(1.95, 0.05), reading(1.95, 0.1)]
    first, second, third = seen(layers_of(), [one], [one, *between], [one, *between])
    assert ahead(first, 1.25) == NO_INFORMATION
    assert ahead(second, 1.25) == FREE
    np.testing.assert_array_equal(second.costs, third.costs)


def test_an_obstacle_that_is_gone_is_freed_by_readings_that_go_past_it():
    there, gone = reading(0.95, 0.0), [reading(1.95, 0.05 + 0.01 * n) for n in range(10)]
    first, second = seen(layers_of(), [there], gone)
    assert ahead(first, 0.95) == LETHAL
    assert ahead(second, 0.95) == FREE


def test_the_longest_reading_clears_where_it_is_asked_to():
    longest = reading(2.0, 0.05)
    _, without = seen(layers_of(), [reading(0.95)], [longest])
    assert ahead(without, 0.95) == LETHAL
    _, cleared = seen(layers_of(clear_on_max_reading=True), [reading(0.95)], [longest])
    assert ahead(cleared, 0.95) == FREE


@pytest.mark.parametrize("range_m", [0.05, 2.5, np.inf, -np.inf])
def test_what_the_sensor_cannot_measure_says_nothing(range_m):
    (costmap,) = seen(layers_of(), [reading(range_m)])
    assert (costmap.costs == NO_INFORMATION).all()


def test_a_switch_marks_at_its_range_and_clears_where_it_is_asked_to():
    there = reading(-np.inf, range_min_m=0.85, range_max_m=0.85)
    nothing = reading(np.inf, 0.05, range_min_m=0.85, range_max_m=0.85)
    first, second = seen(layers_of(clear_on_max_reading=True), [there], [nothing])
    assert ahead(first, 0.85) == LETHAL
    assert ahead(second, 0.85) == FREE
    _, kept = seen(layers_of(), [there], [nothing])
    assert ahead(kept, 0.85) == LETHAL


@pytest.mark.parametrize(("kind", "is_marked"), [("variable", False), ("FIXED", True), ("x", True)])
def test_how_a_reading_counts_can_be_told(kind, is_marked):
    there = reading(-np.inf, range_min_m=0.85, range_max_m=0.85)
    (costmap,) = seen(layers_of(input_sensor_type=kind), [there])
    assert (ahead(costmap, 0.85) == LETHAL) == is_marked


def test_without_readings_for_too_long_a_costmap_is_not_current_until_it_is_cleared():
    layers = layers_of(no_readings_timeout=0.3)
    costmaps = seen(layers, [reading(1.0)], [], [], [reading(1.0, 0.55)])
    # 0.2 s without are borne, 0.4 s are not, and a reading does not mend it: as in Nav2.
    assert [costmap.is_current for costmap in costmaps] == [True, True, False, False]
    state = layers.initial_state()
    for time_s in (0.0, 0.4):
        state = layers.updated(state, scan=None, pose=np.zeros(3), time_s=time_s)
    assert not state.costmap.is_current
    state = layers.updated(layers.cleared(state), scan=None, pose=np.zeros(3), time_s=0.6)
    assert state.costmap.is_current


def test_after_clearing_the_newest_reading_counts():
    layers = layers_of()
    state = layers.initial_state()
    readings = {"sonar": (reading(0.55, 0.0), reading(1.05, 0.1))}
    state = layers.updated(state, scan=None, pose=np.zeros(3), time_s=0.1, ranges=readings)
    assert ahead(state.costmap, 0.55) == FREE
    assert ahead(state.costmap, 1.05) == LETHAL


def test_a_layer_that_waits_for_a_sensor_that_is_not_there_is_told_in_a_line():
    costmap = {"plugins": ["sonar"], "sonar": {"plugin": SONAR, "topics": ["sonra"]}}
    robot = {
        "description": "with a sonar",
        "robot_radius": 0.3,
        "range_sensors": {"sonar": {}},
        "navigation": {"local_costmap": costmap},
    }
    with pytest.raises(InputError, match="no range sensor 'sonra'; did you mean 'sonar'"):
        validate(Robot, robot, "robot.yaml")
