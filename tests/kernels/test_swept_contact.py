"""A moving outline is caught at its first touch, whatever it would pass over within a step."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from pydrake.geometry import SceneGraph
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from scenes import WHEELCHAIR

from drake_navbench.inputs.drive import DifferentialDrive
from drake_navbench.kernels.swept_contact import (
    clearance_at,
    covers,
    pose_within_step,
    share_until_contact,
    soonest_contact_s,
)
from drake_navbench.trial.simulation import INTEGRATION
from drake_navbench.trial.systems.wheelchair import Wheelchair

CORNER_M = math.hypot(0.85, 0.3)
STEP_S = 0.02
TOUCHING_M = 1e-5
NO_EDGES, NO_CIRCLES = np.empty((0, 4)), np.empty((0, 3))


def share(start, end, *, edges=NO_EDGES, circles=NO_CIRCLES, footprint=WHEELCHAIR):
    """Returns the share of a step until contact."""
    return share_until_contact(
        footprint,
        np.array(start, dtype=float),
        np.array(end, dtype=float),
        STEP_S,
        np.array(edges, dtype=float).reshape(-1, 4),
        np.array(circles, dtype=float).reshape(-1, 3),
        TOUCHING_M,
    )


def after_step(start):
    """Returns the state (6,) after a step at a constant twist."""
    x, y, yaw, v, w, _ = start
    turned = yaw + w * STEP_S
    if w == 0.0:
        along = np.array([math.cos(yaw), math.sin(yaw)]) * v * STEP_S
    else:
        turn = [math.sin(turned) - math.sin(yaw), math.cos(yaw) - math.cos(turned)]
        along = np.array(turn) * v / w
    return np.array([x + along[0], y + along[1], turned, v, w, 0.0])


def test_the_motion_within_a_step_is_the_dense_output_of_drake():
    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(SceneGraph())
    wheelchair = builder.AddSystem(
        Wheelchair(DifferentialDrive(), scene_graph, footprint=WHEELCHAIR)
    )
    command = builder.AddSystem(ConstantVectorSource([0.5, 1.5, 0.0]))
    builder.Connect(command.get_output_port(), wheelchair.get_command_input_port())
    simulator = Simulator(builder.Build())
    ApplySimulatorConfig(INTEGRATION, simulator)
    simulator.Initialize()
    simulator.AdvanceTo(0.3)
    context = simulator.get_context()
    start = wheelchair.get_state_output_port().Eval(wheelchair.GetMyContextFromRoot(context))
    simulator.get_mutable_integrator().StartDenseIntegration()
    simulator.AdvanceTo(0.3 + STEP_S)
    dense = simulator.get_mutable_integrator().StopDenseIntegration()
    end = wheelchair.get_state_output_port().Eval(wheelchair.GetMyContextFromRoot(context))
    for part in np.linspace(0.0, 1.0, 7):
        pose = pose_within_step(start, end, STEP_S, part)
        np.testing.assert_allclose(pose, dense.value(0.3 + part * STEP_S)[:3, 0], atol=1e-12)


def test_the_clearance_is_to_the_nearest_of_edges_and_circles():
    wall, pillar = np.array([[2.0, -5.0, 2.0, 5.0]]), np.array([[-1.0, 0.0, 0.25]])
    # Fronts at 0.85 and 2.0; the back at -0.25, the pillar's rim at -0.75.
    assert clearance_at(WHEELCHAIR, 0.0, 0.0, 0.0, wall, NO_CIRCLES, 5.0) == pytest.approx(1.15)
    assert clearance_at(WHEELCHAIR, 0.0, 0.0, 0.0, wall, pillar, 5.0) == pytest.approx(0.5)
    assert clearance_at(WHEELCHAIR, 0.0, 0.0, 0.0, wall, pillar, 0.4) == math.inf
    assert clearance_at(WHEELCHAIR, -0.8, 0.0, 0.0, wall, pillar, 5.0) == 0.0


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((0.5, 0.5), True),  # in one square
        ((1.5, 1.5), True),  # in both
        ((3.5, 0.5), False),  # beside them
        ((0.5, 2.5), False),  # in the corner between them
        ((5.9, 0.0), True),  # in the disc
        ((6.1, 0.0), False),  # beyond it
    ],
)
def test_a_point_is_covered_inside_any_outline_or_disc(point, expected):
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    squares = [corners, corners + 1.0]
    edges = np.vstack([np.hstack([s, np.roll(s, -1, axis=0)]) for s in squares])
    assert covers(edges, np.array([[5.0, 0.0, 1.0]]), *point) == expected


@pytest.mark.parametrize("v", [0.5, 5.0])
def test_a_thin_wall_ahead_is_met_when_the_front_gets_there(v):
    gap_m = 0.6 * v * STEP_S
    wall = [0.85 + gap_m, -1.0, 0.85 + gap_m, 1.0]
    start = [0.0, 0.0, 0.0, v, 0.0, 0.0]
    met = share(start, after_step(start), edges=[wall])
    assert met == pytest.approx(0.6, abs=TOUCHING_M / (v * STEP_S) * 1.01)
    assert met <= 0.6


@pytest.mark.parametrize("depth_m", [1e-4, 2e-3, 1e-2])
def test_a_post_under_the_corner_is_met_though_both_ends_of_the_step_are_clear(depth_m):
    # At 10 rad/s to the left the corner sweeps 0.18 m a step; at this radius the side, y = 0.3,
    # comes round first.
    w, radius = 10.0, CORNER_M - depth_m
    bearing = math.atan2(0.3, 0.85) + 0.5 * w * STEP_S
    post = np.array([[radius * math.cos(bearing), radius * math.sin(bearing), 0.0]])
    start = [0.0, 0.0, 0.0, 0.0, w, 0.0]
    end = after_step(start)
    met = share(start, end, circles=post)
    assert met * w * STEP_S == pytest.approx(bearing - math.asin(0.3 / radius), abs=2e-4)
    assert clearance_at(WHEELCHAIR, *end[:3], NO_EDGES, post, 1.0) > 0.01


def test_passing_by_is_no_contact_however_close():
    start = [0.0, 0.0, 0.0, 0.5, 0.0, 0.0]
    beside = [-1.0, 0.3 + 2.0 * TOUCHING_M, 3.0, 0.3 + 2.0 * TOUCHING_M]
    assert share(start, after_step(start), edges=[beside]) == math.inf


def test_a_wall_beside_is_met_when_the_robot_goes_sideways():
    # The left side at 0.3 m, at 0.5 m/s: half a step of 0.02 s is 5 mm.
    start = [0.0, 0.0, 0.0, 0.0, 0.0, 0.5]
    end = [0.0, 0.5 * STEP_S, 0.0, 0.0, 0.0, 0.5]
    wall = [-1.0, 0.3 + 0.25 * STEP_S, 3.0, 0.3 + 0.25 * STEP_S]
    assert share(start, end, edges=[wall]) == pytest.approx(0.5, abs=TOUCHING_M / (0.5 * STEP_S))


def test_standing_still_touches_nothing_new():
    start = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert share(start, start, edges=[[0.86, -1.0, 0.86, 1.0]]) == math.inf
    assert share(start, start, edges=[[0.85, -1.0, 0.85, 1.0]]) == 0.0


speeds, rates = st.floats(-5.0, 5.0), st.floats(-20.0, 20.0)


@given(v=speeds, w=rates, dv=speeds, dw=rates, x=st.floats(-1.2, 1.2), y=st.floats(-1.2, 1.2))
def test_nothing_is_touched_before_the_first_contact_and_something_at_it(v, w, dv, dw, x, y):
    post = np.array([[x, y, 0.002]])
    start = np.array([0.0, 0.0, 0.0, v, w, 0.0])
    end = after_step([0.0, 0.0, 0.0, v + 0.5 * dv, w + 0.5 * dw, 0.0])
    end[3:5] = v + dv, w + dw
    assume(clearance_at(WHEELCHAIR, *start[:3], NO_EDGES, post, 5.0) > TOUCHING_M)
    met = share(start, end, circles=post)
    parts = np.linspace(0.0, min(met, 1.0), 200, endpoint=False)
    for part in parts:
        pose = pose_within_step(start, end, STEP_S, part)
        assert clearance_at(WHEELCHAIR, *pose, NO_EDGES, post, 5.0) > 0.0
    if math.isfinite(met):
        pose = pose_within_step(start, end, STEP_S, met)
        assert clearance_at(WHEELCHAIR, *pose, NO_EDGES, post, 5.0) <= TOUCHING_M


def test_the_soonest_contact_is_at_the_top_speed_or_after_speeding_up():
    limits = {"speed_mps": 0.5, "top_speed_mps": 2.0}
    # 1 m at 2 m/s; 0.5 m = 0.5 m/s t + 2 m/s^2 t^2 / 2 at t = 0.5 s; nothing left to cross.
    assert soonest_contact_s(1.0, acceleration_mps2=math.inf, **limits) == 0.5
    assert soonest_contact_s(0.5, acceleration_mps2=2.0, **limits) == pytest.approx(0.5)
    assert soonest_contact_s(0.0, acceleration_mps2=2.0, **limits) == 0.0


@given(
    gap=st.floats(1e-6, 5.0),
    speed=st.floats(0.0, 3.0),
    acceleration=st.floats(0.1, 20.0),
    top=st.floats(0.1, 5.0),
)
def test_no_motion_within_the_limits_is_sooner(gap, speed, acceleration, top):
    top = max(top, speed)
    soonest_s = soonest_contact_s(
        gap, speed_mps=speed, acceleration_mps2=acceleration, top_speed_mps=top
    )
    # The fastest: speed up to the top, then keep it.
    speeding_s = min((top - speed) / acceleration, soonest_s)
    way_m = speed * speeding_s + 0.5 * acceleration * speeding_s**2
    way_m += top * (soonest_s - speeding_s)
    assert way_m <= gap * (1.0 + 1e-9)
