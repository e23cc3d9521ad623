"""A trial ends at the instant of the first contact, whatever the clearance is sampled at."""

import math

import numpy as np
import pytest
import shapely
from stub_controller import StubPreset

from drake_navbench.analysis.invariants import violations_of
from drake_navbench.controller import Decision, NoValidControl
from drake_navbench.inputs.drive import DifferentialDrive
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.inputs.world import Box, Cylinder, World
from drake_navbench.kernels.footprint import circle_footprint
from drake_navbench.kernels.poses import place_outline
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.contact_watch import TOUCHING_M, ContactWatch
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate
from drake_navbench.typed_files.typed_yaml import validate

PHASES = 12
CONTROL_PERIOD_S = 0.05
CHAIR = load_robot("wheelchair").outline
CORNER_M, CORNER_RAD = math.hypot(*CHAIR[0]), math.atan2(*CHAIR[0, ::-1])
DISC_M = 0.05
FAST = {"max_linear_velocity_mps": 5.0, "max_linear_acceleration_mps2": None}


def drive(v, w, *, obstacles=(), robot="wheelchair", world=None, directory="", step=None, **drive):
    """Runs a trial under one command, long enough to meet whatever is in the way."""
    data = {
        "name": "contact",
        "description": "a straight plan that nobody follows",
        "world": world or {"obstacles": list(obstacles)},
        "plan": {"type": "polyline", "points": [[0.0, 0.0], [9.0, 0.0]]},
        "goal": [9.0, 0.0, 0.0],
        "timeout_s": 2.0,
    }
    overrides = {"robot_radius": DISC_M} if robot == "round_robot" else {}
    overrides["drive"] = drive
    scenario = validate(Scenario, data | {"robot_overrides": overrides}, "contact.yaml")
    scenario = scenario.model_copy(update={"directory": str(directory)})
    step = step or (lambda observation, memory: Decision(np.array([v, w]), memory))
    spec = TrialSpec(scenario, scenario.load_robot(robot), StubPreset(step), seed=0)
    return simulate(spec), scenario.true_world


def gap_at_the_end(log: TrialLog, outline, world: World) -> float:
    last = log.samples.iloc[-1]
    body = shapely.Polygon(place_outline(outline, (last.x_m, last.y_m, last.yaw_rad)))
    return body.distance(shapely.union_all(list(world.regions)))


def assert_ends_at_contact(log: TrialLog, outline, world: World) -> None:
    assert log.outcome is Outcome.COLLIDED
    assert log.info["reason"] == "the footprint touched an obstacle"
    # A disc in shapely is a polygon within its circle; the post's radius is 0.5 mm.
    assert 0.0 < gap_at_the_end(log, outline, world) < 1.2 * TOUCHING_M
    times = log.samples["time_s"].to_numpy()
    assert (np.diff(times) > 0.0).all()
    assert log.end_time_s == times[-1]
    assert log.samples["clearance_m"].iloc[-1] == 0.0
    assert (log.samples["clearance_m"].iloc[:-1] > 0.0).all()
    assert violations_of(log) == []


@pytest.mark.parametrize("phase", range(PHASES))
@pytest.mark.parametrize("depth_m", [0.002, 0.005, 0.010])
def test_a_thin_post_under_the_corner_of_the_turning_chair_ends_the_trial(depth_m, phase):
    w, radius = 1.0, 0.0005
    bearing = CORNER_RAD + 0.8 + w * CONTROL_PERIOD_S * phase / PHASES
    centre = (CORNER_M - depth_m - radius) * np.array([math.cos(bearing), math.sin(bearing)])
    post = {"type": "cylinder", "centre": centre.tolist(), "radius_m": radius}
    log, world = drive(0.0, w, obstacles=[post])
    assert_ends_at_contact(log, CHAIR, world)


@pytest.mark.parametrize("phase", range(PHASES))
def test_a_fast_disc_does_not_tunnel_through_a_thin_wall(phase):
    x = 3.0 + 5.0 * CONTROL_PERIOD_S * phase / PHASES
    wall = {"type": "wall", "start": [x, -1.0], "end": [x, 1.0], "thickness_m": 0.01}
    log, world = drive(5.0, 0.0, obstacles=[wall], robot="round_robot", **FAST)
    assert_ends_at_contact(log, circle_footprint(DISC_M), world)
    # The lag of 0.1 s is over: 5 m/s t - 0.5 m, from the first cycle at 0.02 s.
    expected_s = (x - 0.005 - DISC_M + 0.5) / 5.0 + 0.02
    assert log.end_time_s == pytest.approx(expected_s, abs=2e-4)


@pytest.fixture
def map_with_a_thin_wall(tmp_path):
    """A map of 1 cm cells from (-1, -1) m, one column of which is occupied: x = 2.00 to 2.01 m."""
    cells = np.full((200, 1100), 254, np.uint8)
    cells[:, 300] = 0
    (tmp_path / "map.pgm").write_bytes(b"P5 1100 200 255\n" + cells.tobytes())
    (tmp_path / "map.yaml").write_text(
        "image: map.pgm\nresolution: 0.01\norigin: [-1.0, -1.0, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    return tmp_path


@pytest.mark.parametrize(
    ("robot", "outline", "front_m"),
    [("round_robot", circle_footprint(DISC_M), DISC_M), ("wheelchair", CHAIR, 0.85)],
)
def test_the_walls_of_a_map_are_met_as_obstacles_are(map_with_a_thin_wall, robot, outline, front_m):
    world = {"map": "map.yaml"}
    log, true_world = drive(
        5.0, 0.0, world=world, directory=map_with_a_thin_wall, robot=robot, **FAST
    )
    assert_ends_at_contact(log, outline, true_world)
    assert log.samples["x_m"].iloc[-1] == pytest.approx(2.0 - front_m, abs=2.0 * TOUCHING_M)


def test_a_task_that_ended_before_the_touch_is_no_collision():
    def gives_up_at(cycle):
        def step(observation, memory):
            if memory == cycle:
                raise NoValidControl("no way")
            return Decision(np.array([0.5, 0.0]), memory + 1)

        return step

    # Given up at 1.02 s, a second after the first cycle. Speeding up at 2.5 m/s^2 to 0.25 m/s and
    # then with the lag of 0.1 s costs 0.0375 m and 0.025 m. The wall is 2 mm ahead: 4 ms.
    x = 0.85 + 0.5 - 0.0625 + 0.002
    wall = {"type": "wall", "start": [x, -1.0], "end": [x, 1.0], "thickness_m": 1e-4}
    ended, _ = drive(0.0, 0.0, obstacles=[wall], step=gives_up_at(20))
    assert ended.outcome is Outcome.ABORTED
    assert ended.end_time_s == pytest.approx(1.02)
    a_cycle_later, _ = drive(0.0, 0.0, obstacles=[wall], step=gives_up_at(21))
    assert a_cycle_later.outcome is Outcome.COLLIDED
    assert a_cycle_later.end_time_s == pytest.approx(1.024, abs=1e-3)


def test_what_the_last_cycle_left_is_in_the_log_of_a_collided_trial():
    def step(observation, memory):
        return Decision(np.array([0.5, 0.0]), memory + 1, {"cycle": memory})

    wall = {"type": "wall", "start": [1.2, -1.0], "end": [1.2, 1.0], "thickness_m": 0.01}
    log, _ = drive(0.0, 0.0, obstacles=[wall], step=step)
    assert log.outcome is Outcome.COLLIDED
    assert [left["cycle"] for _, left in log.diagnostics] == list(
        range(log.samples["cycle_count"].iloc[-1])
    )
    assert max(time_s for time_s, _ in log.diagnostics) <= log.end_time_s


def watch(*obstacles, walls=(), footprint=CHAIR):
    return ContactWatch(
        DifferentialDrive(), World(obstacles, walls), footprint=footprint, max_step_s=0.02
    )


def box(low, high):
    return Box(type="box", min=low, max=high)


def test_nothing_is_looked_at_as_long_as_the_limits_of_the_drive_rule_contact_out():
    at_rest = watch(box((1.85, -1.0), (2.0, 1.0)))
    at_rest.look(0.0, np.zeros(6))
    # 1 m less 10 um ahead. The outline gets no faster than 0.5 m/s + 2 rad/s * 0.901 m, and has
    # to speed up at no more than 2.5 m/s^2 + 3 rad/s^2 * 0.901 m.
    rate = 2.5 + 3.0 * CORNER_M
    expected_s = max((1.0 - 1e-5) / (0.5 + 2.0 * CORNER_M), math.sqrt(2.0 * (1.0 - 1e-5) / rate))
    assert at_rest.contact is None
    assert at_rest.idle_until_s == pytest.approx(expected_s - 1.1 * 0.02)


def test_a_start_in_contact_is_a_contact_at_the_start():
    touching = watch(walls=(box((0.85, -1.0), (2.0, 1.0)),))
    touching.look(0.0, np.zeros(6))
    assert touching.contact.time_s == 0.0


def test_a_start_wholly_inside_an_obstacle_is_one_too():
    inside_box = watch(box((-5.0, -5.0), (5.0, 5.0)))
    inside_pillar = watch(Cylinder(type="cylinder", centre=(1.0, 0.0), radius_m=4.0))
    for inside in (inside_box, inside_pillar):
        inside.look(0.0, np.zeros(6))
        assert inside.contact.time_s == 0.0


def test_the_state_at_contact_is_that_of_the_step_there():
    ahead = watch(box((0.855, -1.0), (2.0, 1.0)))
    ahead.look(0.0, np.array([0.0, 0.0, 0.0, 0.4, 0.0, 0.0]))
    # From 0.4 to 0.6 m/s in 0.02 s: 10 mm, of which half lies before the box.
    ahead.look(0.02, np.array([0.01, 0.0, 0.0, 0.6, 0.0, 0.0]))
    contact = ahead.contact
    assert contact.state[0] == pytest.approx(0.005, abs=2.0 * TOUCHING_M)
    # 0.4 t + 5 t^2 = 0.005
    expected_s = (math.sqrt(0.4**2 + 20.0 * 0.005) - 0.4) / 10.0
    assert contact.time_s == pytest.approx(expected_s, abs=5e-5)
    assert contact.state[3] == pytest.approx(0.4 + 10.0 * expected_s, abs=1e-3)
