"""Whole trials on maps, with keepouts and speed zones."""

import numpy as np
import pytest
import shapely

from drake_navbench import run_trial
from drake_navbench.analysis.metrics.safety import obstacle_outlines
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.inputs.scenario_plan import PolylinePlan
from drake_navbench.kernels.poses import place_outline
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.planning import make_plan


@pytest.fixture(scope="module")
def ward() -> TrialLog:
    return run_trial("speed_zone", "rpp", seed=1)


def test_a_wheelchair_gets_through_a_door():
    log = run_trial("doorway", "rpp", seed=1)
    assert log.outcome is Outcome.SUCCEEDED
    # 0.9 m less 0.6 m leaves 0.15 m to either side.
    assert 0.05 < log.samples["clearance_m"].min() < 0.15


def test_the_ward_is_crossed(ward):
    assert ward.outcome is Outcome.SUCCEEDED


def test_a_speed_zone_is_driven_at_its_speed(ward):
    samples = ward.samples
    inside = samples[(samples.x_m > 3.4) & (samples.x_m < 8.9)]
    # The filter looks every 0.2 s, and the wheels lag by 0.1 s; then 40% of 0.5 m/s hold.
    np.testing.assert_allclose(inside["v_mps"], 0.2, atol=1e-3)
    before = samples[(samples.x_m > 0.5) & (samples.x_m < 3.0)]
    assert before["v_mps"].median() == pytest.approx(0.5, abs=1e-3)
    after = samples[(samples.x_m > 9.6) & (samples.x_m < 10.4)]
    assert after["v_mps"].max() == pytest.approx(0.5, abs=1e-3)


def test_the_log_tells_when_the_speed_limit_changed(ward):
    entered, left = ward.info["speed_filter"]
    assert (entered["limit"], entered["is_percentage"]) == (40.0, True)
    assert left["limit"] is None
    x_m = np.interp([entered["time_s"], left["time_s"]], ward.samples.time_s, ward.samples.x_m)
    # Within the 0.2 s between two looks, at 0.5 m/s and at 0.2 m/s.
    assert 3.0 <= x_m[0] <= 3.0 + 0.2 * 0.5 + 0.02
    assert 9.0 <= x_m[1] <= 9.0 + 0.2 * 0.2 + 0.02


def test_a_keepout_is_never_entered_by_any_part_of_the_wheelchair(ward):
    (keepout,) = (entry for entry in load_scenario("speed_zone").filters if entry.type == "keepout")
    area = shapely.Polygon(keepout.areas[0].polygon)
    footprint = np.array(ward.info["robot"]["footprint"])
    for sample in ward.samples.iloc[::10].itertuples():
        body = place_outline(footprint, (sample.x_m, sample.y_m, sample.yaw_rad))
        assert not shapely.Polygon(body).intersects(area)
    # It lies across the straight way.
    assert area.intersects(shapely.LineString([(0.0, -1.0 - 0.3), (11.0, -1.0 - 0.3)]))


def test_the_log_holds_the_walls_of_the_map(ward):
    walls = shapely.union_all([shapely.Polygon(outline) for outline in obstacle_outlines(ward)])
    assert walls.equals(walls)
    assert walls.intersects(shapely.Point(1.45, 1.5))  # a bed
    assert not walls.intersects(shapely.Point(0.0, -1.0))
    ahead = ward.scans[0].ranges_m[np.argmin(np.abs(ward.scans[0].angles_rad))]
    # From (0, -1) along x to the wall at 12.4 m: beyond the lidar's 12 m.
    assert not np.isfinite(ahead)
    behind = ward.scans[0].ranges_m[np.argmax(np.abs(ward.scans[0].angles_rad))]
    assert behind == pytest.approx(1.4, abs=1e-3)


def test_clearance_is_measured_to_the_walls_of_the_map_and_ends_a_trial(ward):
    first = ward.samples.iloc[5]
    # The back of the chair is at x = -0.25, the wall's face at -1.4.
    assert first.clearance_m == pytest.approx(1.4 - 0.25, abs=0.01)
    # Driven straight at a bed by a controller that does not look, the chair collides.
    into_the_bed = load_scenario("speed_zone").model_copy(
        update={
            "plan": PolylinePlan(type="polyline", points=[(1.45, -1.0), (1.45, 2.0)]),
            "start": (1.45, -1.0, np.pi / 2),
        }
    )
    log = run_trial(into_the_bed, "rpp:use_collision_detection=false", seed=1)
    assert log.outcome is Outcome.COLLIDED
    # The front reaches 0.85 m ahead of the axle, the bed's foot is at y = 0.9.
    assert log.samples.iloc[-1].y_m == pytest.approx(0.9 - 0.85, abs=0.03)


def lane_share(scenario: Scenario) -> float:
    """Returns the share of the plan's poses that lie in the lane of preferred_lane."""
    robot = scenario.load_robot("wheelchair")
    plan = make_plan(scenario, robot, np.array(scenario.start))
    return float(np.mean((plan[:, 1] > 1.4) & (plan[:, 1] < 2.6)))


def test_a_plan_prefers_the_lane_that_a_graded_mask_leaves_cheap():
    scenario = load_scenario("preferred_lane")
    assert lane_share(scenario) > 0.6
    # Where nothing is graded the straight way is the best.
    assert lane_share(Scenario(**scenario.model_dump(exclude={"filters"}))) == 0.0


def test_a_robot_drives_along_the_preferred_lane():
    log = run_trial("preferred_lane", "rpp")
    assert log.outcome is Outcome.SUCCEEDED
    assert log.samples["y_m"].max() > 1.4
