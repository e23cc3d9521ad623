"""Missions over two floors, driven: times, places, and what is seen and remembered where."""

from __future__ import annotations

import numpy as np
import pytest
from mission_scenes import EXACT, SMALL, small_mission
from pydrake.systems.analysis import Simulator

from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.column_controller import built_controller
from drake_navbench.trial.diagram import TrialDiagram, build_trial_diagram
from drake_navbench.trial.floors import drawn_legs
from drake_navbench.trial.simulation import trial_task
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.systems.lifetime import release
from drake_navbench.trial.systems.ports import read_object
from drake_navbench.trial.trial import run_trial


def drive(scenario: Scenario, **options) -> TrialLog:
    return run_trial(scenario, "rpp", keeps_costmaps=True, **options)


@pytest.fixture(scope="module")
def without_travel() -> TrialLog:
    return drive(small_mission())


@pytest.fixture(scope="module")
def ten_seconds() -> TrialLog:
    lift = {"travel_s": 10.0, "xy_std_m": 0.1, "yaw_std_rad": 0.05}
    return drive(small_mission(lift))


def floor_rows(log: TrialLog, floor: int):
    return log.samples[log.samples["floor"] == floor]


def test_ten_seconds_more_of_travel_or_doors_make_a_mission_ten_seconds_longer():
    times = ({"travel_s": 2.0}, {"travel_s": 12.0}, {"travel_s": 2.0, "door_s": 10.0})
    shorter, longer, with_doors = (drive(small_mission(lift)) for lift in times)
    assert shorter.outcome is Outcome.SUCCEEDED
    assert longer.end_time_s - shorter.end_time_s == pytest.approx(10.0, abs=1e-9)
    assert with_doors.end_time_s == longer.end_time_s


def test_the_lift_brings_the_robot_to_its_stop_as_it_stood_in_it(without_travel):
    before = floor_rows(without_travel, 0).iloc[-1]
    after = floor_rows(without_travel, 1).iloc[0]
    (floor,) = (one for one in without_travel.info["floors"] if one["name"] == "upper")
    ahead_m, left_m = before["x_m"] - 0.8, before["y_m"]
    x_m = 5.0 + floor["offset_m"][0] + ahead_m * np.cos(1.5) - left_m * np.sin(1.5)
    y_m = 2.0 + ahead_m * np.sin(1.5) + left_m * np.cos(1.5)
    # It may still roll, for a tick.
    assert (after["x_m"], after["y_m"]) == pytest.approx((x_m, y_m), abs=0.01)
    assert after["yaw_rad"] == pytest.approx(before["yaw_rad"] + 1.5, abs=0.01)


def test_the_first_estimate_upstairs_is_off_by_the_drawn_error(ten_seconds):
    error = drawn_legs(small_mission({"xy_std_m": 0.1, "yaw_std_rad": 0.05}), 0)[0].then.ride.error
    assert np.abs(error).min() > 0.0
    first = floor_rows(ten_seconds, 1).iloc[0]
    off = [first[f"estimated_{name}"] - first[name] for name in ("x_m", "y_m", "yaw_rad")]
    np.testing.assert_allclose(off, error, atol=1e-9)
    last = floor_rows(ten_seconds, 0).iloc[-1]
    assert last["estimated_x_m"] == pytest.approx(last["x_m"], abs=1e-12)


def test_every_controller_meets_the_same_ride():
    lift = {"travel_s": 4.0, "travel_std_s": 1.0, "late_mean_s": 2.0, "xy_std_m": 0.1}
    legs = [
        run_trial(small_mission(lift), preset, seed=5).info["legs"][0] for preset in ("rpp", "dwb")
    ]
    waits = [leg["lift_events"][-1]["time_s"] - leg["end_time_s"] for leg in legs]
    assert legs[0]["end_time_s"] != legs[1]["end_time_s"]
    assert waits[0] == pytest.approx(waits[1], abs=1e-8)


def test_nothing_of_the_ground_floor_is_seen_upstairs(without_travel):
    change_s = without_travel.info["legs"][0]["ride_end_s"]
    seen = {
        floor: [np.isfinite(scan.ranges_m).any() for scan in without_travel.scans if chosen(scan)]
        for floor, chosen in (
            (0, lambda scan: scan.time_s < change_s),
            (1, lambda scan: scan.time_s > change_s),
        )
    }
    assert all(seen[0])
    assert not any(seen[1])


def test_what_moves_downstairs_is_not_seen_upstairs():
    cart = {
        "type": "box",
        "size_m": [0.5, 0.5],
        "waypoints": [{"time_s": 0.0, "position": [4.0, 2.0]}],
    }
    floors = [{"name": "ground", "world": {"moving_obstacles": [cart]}}, {"name": "upper"}]
    lift = {"stops": {"ground": [0.8, 0.0, 0.0], "upper": [0.0, 2.0, 0.0]}}
    mission = [{"lift": "main", "to": "upper"}, {"floor": "upper", "goal": [1.0, 2.0, 0.0]}]
    log = drive(small_mission(lift, floors=floors, mission=mission))
    change_s = log.info["legs"][0]["ride_end_s"]
    apart_m = log.info["floors"][1]["offset_m"][0] - 4.25
    # It would be within the lidar's 12 m.
    assert apart_m < 12.0
    assert all(np.isfinite(s.ranges_m).any() for s in log.scans if s.time_s < change_s)
    assert not any(np.isfinite(s.ranges_m).any() for s in log.scans if s.time_s > change_s)


def built(scenario: Scenario, controller) -> TrialDiagram:
    robot = scenario.load_robot("wheelchair")
    spec = TrialSpec(scenario, robot, load_preset("rpp").for_robot(robot), seed=0)
    return build_trial_diagram(robot, scenario.true_world, controller, task=trial_task(spec))


def test_costmaps_are_empty_after_the_change_of_floor(without_travel):
    scenario = small_mission()
    robot = scenario.load_robot("wheelchair")
    change_s = without_travel.info["legs"][0]["ride_end_s"] - 0.0037
    with built_controller(load_preset("rpp"), robot, wants_diagnostics=False) as controller:
        trial = built(scenario, controller)
        context = trial.create_context(np.zeros(3), 0)
        simulator = Simulator(trial.diagram, context)

        def costmaps():
            names = ("local_costmap", "global_costmap")
            systems = [trial.diagram.GetSubsystemByName(name) for name in names]
            return [
                read_object(system.GetOutputPort("costmap"), system.GetMyContextFromRoot(context))
                for system in systems
            ]

        simulator.AdvanceTo(change_s - 1e-3)
        assert all((costmap.costs == 254).any() for costmap in costmaps())
        simulator.AdvanceTo(change_s + 1e-3)
        local, whole = costmaps()
        assert local is None
        assert not (whole.costs == 254).any()
        assert whole.origin_x > 3.0
        release(trial.own_systems)


@pytest.mark.parametrize(
    ("lift", "reason"),
    [
        ({"refused_probability": 1.0}, "leg 1 of 2: lift main was refused"),
        (
            {"refused_probability": 1.0, "patience_s": 3.0, "retry_s": 2.0},
            "leg 1 of 2: lift main was refused 2 times within 3 s",
        ),
        (
            {"late_mean_s": 1e4, "patience_s": 2.0},
            "leg 1 of 2: lift main did not come within 2 s",
        ),
    ],
)
def test_a_mission_whose_lift_fails_ends_with_the_reason(lift, reason):
    log = drive(small_mission(lift))
    assert (log.outcome, log.info["reason"]) == (Outcome.ABORTED, reason)
    waited_s = log.end_time_s - log.info["legs"][0]["end_time_s"]
    assert waited_s == pytest.approx(lift.get("patience_s", 0.05))


def test_amcl_begins_anew_around_where_the_lift_left_it_and_finds_the_pose():
    room = [
        {"type": "box", "min": [2.0, 0.0], "max": [8.0, 0.2]},
        {"type": "box", "min": [2.0, 5.0], "max": [8.0, 5.2]},
        {"type": "box", "min": [2.0, 0.0], "max": [2.2, 5.2]},
        {"type": "box", "min": [7.8, 0.0], "max": [8.0, 5.2]},
        {"type": "box", "min": [6.0, 4.0], "max": [6.5, 5.0]},
    ]
    walls = [{"type": "box", "min": [-2.0, y], "max": [4.0, y + 0.2]} for y in (-2.0, 2.0)]
    floors = [
        {"name": "ground", "world": {"obstacles": walls}},
        {"name": "upper", "world": {"obstacles": room}},
    ]
    amcl = {"max_particles": 1000, "initial_xy_std_m": 0.25, "update_min_d": 0.1}
    overrides = {"localization": EXACT["localization"] | {"amcl": amcl}}
    log = drive(small_mission({"xy_std_m": 0.2}, floors=floors, robot_overrides=overrides), seed=1)
    error = drawn_legs(small_mission({"xy_std_m": 0.2}), 1)[0].then.ride.error
    upstairs = floor_rows(log, 1)
    off = np.column_stack(
        [upstairs[f"estimated_{name}"] - upstairs[name] for name in ("x_m", "y_m")]
    )
    np.testing.assert_allclose(off[0], error[:2], atol=1e-9)
    assert np.hypot(*off[-1]) < 0.1 < np.hypot(*off[0])
    assert log.outcome is Outcome.SUCCEEDED


def test_a_door_between_two_maps_of_one_storey_moves_nothing():
    beyond = [{"type": "box", "min": [4.0, -1.0], "max": [4.2, 1.0]}]
    floors = [
        {"name": "west", "origin": [0.0, 0.0]},
        {"name": "east", "origin": [2.0, 0.0], "world": {"obstacles": beyond}},
    ]
    lift = {"stops": {"west": [1.5, 0.0, 0.0], "east": [-0.5, 0.0, 0.0]}}
    mission = [{"lift": "main", "to": "east"}, {"floor": "east", "goal": [1.5, 0.0, 0.0]}]
    log = drive(small_mission(lift, floors=floors, mission=mission))
    assert log.outcome is Outcome.SUCCEEDED
    steps = np.hypot(np.diff(log.samples["x_m"]), np.diff(log.samples["y_m"]))
    assert steps.max() < 0.02
    # What stands on the other map of the storey is seen from the first scan on.
    assert log.scans[0].ranges_m.min() == pytest.approx(6.0, abs=0.01)


def test_limits_of_speed_hold_on_their_floor_alone():
    slow = {
        "type": "speed_absolute",
        "areas": [
            {"polygon": [[-1.0, -1.0], [2.0, -1.0], [2.0, 0.9], [-1.0, 0.9]], "value": 20},
        ],
        "multiplier": 0.01,
    }
    ground, upper = SMALL["floors"]
    floors = [ground | {"filters": [slow]}, upper]
    overrides = EXACT | {"navigation": {"local_costmap": {"filters": ["speed_filter"]}}}
    log = drive(small_mission(floors=floors, robot_overrides=overrides))
    limits = [(change["limit"], change["time_s"]) for change in log.info["speed_filter"]]
    assert [limit for limit, _ in limits] == [0.2, None]
    assert limits[1][1] == pytest.approx(log.info["legs"][0]["ride_end_s"], abs=0.005)
    assert floor_rows(log, 0)["v_mps"].max() <= 0.25 < floor_rows(log, 1)["v_mps"].max()


def test_what_comes_late_from_the_ground_floor_does_not_come_upstairs():
    timing = {"scan_latency_s": 0.3, "odometry_latency_s": 0.3, "odometry_jitter_s": 0.1}
    overrides = EXACT | {
        "timing": timing,
        "depth_sensors": {"camera": {"height_m": 0.4}},
        "navigation": {"controller_server": {"costmap_update_timeout": 1.0}},
    }
    log = drive(small_mission({"yaw_std_rad": 0.02}, robot_overrides=overrides))
    assert log.outcome is Outcome.SUCCEEDED
    change_s = log.info["legs"][0]["ride_end_s"]
    assert not any(np.isfinite(s.ranges_m).any() for s in log.scans if s.time_s > change_s)
    upstairs = floor_rows(log, 1)
    off_m = np.hypot(
        upstairs["estimated_x_m"] - upstairs["x_m"], upstairs["estimated_y_m"] - upstairs["y_m"]
    )
    # Messages are up to 0.4 s old, at half a metre a second; floors are 13 m apart.
    assert off_m.max() < 0.4


def test_people_live_on_all_floors_and_meet_those_of_their_own():
    walker = {"start": [7.0, 3.5], "goals": [[3.0, 3.5]], "group": 1}
    people = {"persons": [walker]}
    ground, upper = SMALL["floors"]
    floors = [
        {"name": "ground", "world": ground["world"] | {"people": people}},
        upper | {"world": {"people": people}},
    ]
    log = drive(small_mission(floors=floors))
    assert log.outcome is Outcome.SUCCEEDED
    first, second = log.people.poses[0]
    offset_m = log.info["floors"][1]["offset_m"][0]
    assert second[0] - first[0] == pytest.approx(offset_m)
    # Both walk from the beginning on, wherever the robot is.
    moved = log.people.poses[60] - log.people.poses[0]
    assert (moved[:, 0] < -0.5).all()


def test_who_comes_out_of_the_lift_into_a_cart_has_touched_it():
    cart = {
        "type": "box",
        "name": "cart",
        "size_m": [0.6, 0.6],
        "waypoints": [{"time_s": 0.0, "position": [5.0, 2.5]}],
    }
    ground, upper = SMALL["floors"]
    floors = [ground, upper | {"world": {"moving_obstacles": [cart]}}]
    log = drive(small_mission(floors=floors))
    assert log.outcome is Outcome.COLLIDED
    assert log.info["contact"]["name"] == "cart"
    assert log.end_time_s == pytest.approx(log.info["legs"][0]["ride_end_s"], abs=0.021)
    assert log.samples["floor"].iloc[-1] == 1


def test_the_contact_is_put_back_to_where_it_was_upstairs():
    wall = {"type": "box", "min": [4.0, 3.2], "max": [6.0, 3.4], "known_to_planner": False}
    ground, upper = SMALL["floors"]
    floors = [ground, upper | {"world": {"obstacles": [wall | {"material": "glass"}]}}]
    mission = [SMALL["mission"][0], {"floor": "upper", "goal": [5.0, 6.0, 1.5]}]
    log = drive(small_mission(floors=floors, mission=mission))
    assert log.outcome is Outcome.COLLIDED
    last = log.samples.iloc[-1]
    # The front is 0.85 m ahead, and nearly square to the wall.
    corners_y = last["y_m"] + 0.85 * np.sin(last["yaw_rad"]) + 0.3 * abs(np.cos(last["yaw_rad"]))
    assert corners_y == pytest.approx(3.2, abs=1e-3)
    assert last["clearance_m"] == 0.0
