"""What becomes of a robot at a lift: as its times say, drawn of the seed and the leg alone."""

from __future__ import annotations

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.navigation.lift_ride import LiftTimes, draw_ride
from drake_navbench.typed_files.typed_yaml import validate


def test_a_door_between_two_maps_takes_no_time():
    ride = draw_ride(LiftTimes(), seed=0, leg=1)
    assert ride.events == ((0.0, "requested"), (0.0, "came"), (0.0, "arrived"))
    assert (ride.duration_s, ride.failure, ride.error) == (0.0, "", (0.0, 0.0, 0.0))


def test_a_lift_that_is_never_late_takes_its_doors_and_its_travel():
    ride = draw_ride(LiftTimes(door_s=4.0, travel_s=10.0), seed=3, leg=2)
    assert ride.events[-1] == (14.0, "arrived")


def test_a_ride_depends_on_seed_and_leg_and_on_nothing_else():
    times = LiftTimes(travel_s=10.0, travel_std_s=2.0, late_mean_s=5.0, xy_std_m=0.1)
    rides = {(seed, leg): draw_ride(times, seed, leg) for seed in (0, 1) for leg in (1, 2)}
    assert draw_ride(times, 1, 2) == rides[1, 2]
    assert len({ride.duration_s for ride in rides.values()}) == 4
    assert len({ride.error for ride in rides.values()}) == 4


def test_lateness_is_exponential_and_the_error_normal():
    times = LiftTimes(late_mean_s=8.0, xy_std_m=0.05, yaw_std_rad=0.02)
    rides = [draw_ride(times, seed, 1) for seed in range(2000)]
    late_s = np.array([ride.duration_s for ride in rides])
    # Mean and standard deviation of an exponential distribution are one; 4 standard errors.
    assert abs(late_s.mean() - 8.0) < 4 * 8.0 / 2000**0.5
    assert abs(late_s.std() - 8.0) < 0.8
    errors = np.array([ride.error for ride in rides])
    np.testing.assert_allclose(errors.std(axis=0), [0.05, 0.05, 0.02], rtol=0.1)


def test_a_request_that_is_turned_down_ends_it_where_the_robot_asks_once():
    ride = draw_ride(LiftTimes(refused_probability=1.0), seed=0, leg=1)
    assert ride.failure == "was refused"
    assert ride.duration_s == 0.0


def test_a_patient_robot_asks_again_until_its_patience_is_over():
    times = LiftTimes(refused_probability=1.0, retry_s=4.0, patience_s=10.0)
    ride = draw_ride(times, seed=0, leg=1)
    asked = [time_s for time_s, name in ride.events if name == "requested"]
    assert asked == [0.0, 4.0, 8.0]
    assert ride.events[-1] == (10.0, "gave up")
    assert (ride.duration_s, ride.failure) == (10.0, "was refused 3 times within 10 s")


def test_a_patient_robot_gets_its_lift_after_refusals():
    times = LiftTimes(refused_probability=0.5, retry_s=4.0, patience_s=400.0, travel_s=10.0)
    rides = [draw_ride(times, seed, 1) for seed in range(200)]
    assert not any(ride.failure for ride in rides)
    refusals = [sum(name == "refused" for _, name in ride.events) for ride in rides]
    assert [ride.duration_s for ride in rides] == [4.0 * n + 10.0 for n in refusals]
    # A geometric distribution with mean 1.
    assert 0.7 < np.mean(refusals) < 1.3


def test_a_lift_that_comes_too_late_is_given_up():
    times = LiftTimes(late_mean_s=1e4, patience_s=3.0)
    ride = draw_ride(times, seed=0, leg=1)
    assert (ride.duration_s, ride.failure) == (3.0, "did not come within 3 s")


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"travel_s": -1.0}, "travel_s: input should be greater than or equal to 0, got -1"),
        ({"door_s": -0.5}, "door_s: input should be greater than or equal to 0, got -0.5"),
        ({"refused_probability": 1.5}, "refused_probability: input should be less than or equal"),
        ({"patience_s": 1e4, "retry_s": 1.0}, "expected at most 1000 requests within patience_s"),
    ],
)
def test_times_that_cannot_be_are_refused_in_one_line(fields, said):
    with pytest.raises(InputError, match=said) as caught:
        validate(LiftTimes, fields, "a.yaml")
    assert "\n" not in str(caught.value)
