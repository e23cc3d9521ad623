"""The parts of a replay: flat meshes, rolling wheels, the pace of the animation."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from pydrake.geometry import Convex, Rgba
from synthetic_logs import LOG_PERIOD_S, circle_log, log_times, make_log, straight_log

from drake_navbench.analysis.replay.actors import (
    MAX_POSE_KEYS,
    Pace,
    add_robot,
    base_motion,
)
from drake_navbench.analysis.replay.flat_meshes import arrow, dashes, ribbon, ring, thinned
from drake_navbench.analysis.replay.page import LegendRow
from drake_navbench.analysis.replay.robot_model import PrismModel, SdfModel
from drake_navbench.analysis.replay.rolling import rolled_angle, trailing_heading
from drake_navbench.analysis.replay.scene import (
    CAMERA_ASPECT,
    CAMERA_FILL_X,
    CAMERA_FILL_Y,
    CAMERA_FOV_DEG,
    Bounds,
    camera_view,
)
from drake_navbench.analysis.replay.stage import (
    FRAMES_PER_SECOND,
    Stage,
    frames_until,
    spaced_in_time,
)
from drake_navbench.inputs.descriptions.drake_plant import MAX_DRAWN
from drake_navbench.inputs.robot import load_robot

BLUE = Rgba(0.0, 0.0, 1.0, 1.0)
WHEEL_RADIUS_M, CASTER_RADIUS_M, CASTER_TRAIL_M = 0.24, 0.08, 0.03
HALF_TRACK_M = 0.27


@pytest.fixture(scope="module")
def chair():
    return SdfModel(load_robot("wheelchair").model_path)


def triangle_areas(mesh) -> np.ndarray:
    """Returns signed areas, positive where a triangle faces up."""
    a, b, c = (mesh.vertices[:2, corner].T for corner in mesh.faces)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    return 0.5 * (ux * vy - uy * vx)


# --- flat meshes ---


def test_ribbon_covers_length_times_width_and_faces_up():
    path = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]])
    areas = triangle_areas(ribbon(path, width_m=0.1, height_m=0.02))
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx((3.0 + 4.0) * 0.1)


def test_ribbon_keeps_its_width_where_the_path_turns_back():
    path = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]])
    areas = triangle_areas(ribbon(path, width_m=0.1, height_m=0.0))
    assert areas.sum() == pytest.approx(2 * 1.0 * 0.1)


def test_ribbon_of_one_point_is_empty():
    assert ribbon(np.array([[1.0, 2.0]]), width_m=0.1, height_m=0.0).faces.size == 0


def test_dashes_cover_half_of_the_line():
    line = np.array([[0.0, 0.0], [6.0, 0.0]])
    areas = triangle_areas(dashes(line, dash_m=0.5, width_m=0.1, height_m=0.0))
    assert areas.sum() == pytest.approx(6.0 / 2 * 0.1)


def test_ring_lies_at_its_radius():
    mesh = ring([1.0, 2.0], radius_m=0.5, width_m=0.02, height_m=0.3)
    distance = np.hypot(mesh.vertices[0] - 1.0, mesh.vertices[1] - 2.0)
    np.testing.assert_allclose(distance, 0.5, atol=0.011)
    assert set(mesh.vertices[2]) == {0.3}


def test_arrow_points_along_the_pose():
    mesh = arrow([1.0, 2.0, np.pi / 2], length_m=0.4, width_m=0.2, height_m=0.0)
    assert mesh.vertices[:2, 0] == pytest.approx([1.0, 2.4])
    assert (triangle_areas(mesh) > 0).all()


def test_thinned_keeps_the_ends_and_the_spacing():
    points = np.column_stack([0.01 * np.arange(101), np.zeros(101)])
    # 0, 0.3, 0.6, 0.9 m, and the end at 1.0 m.
    np.testing.assert_allclose(thinned(points, 0.295)[:, 0], [0.0, 0.3, 0.6, 0.9, 1.0])


def test_thinned_shrinks_a_standing_robot_to_one_point():
    assert thinned(np.zeros((50, 2)), 0.05).shape == (1, 2)


# --- rolling ---


def test_wheel_turns_by_distance_over_radius():
    time_s = np.linspace(0.0, 10.0, 501)
    angle = rolled_angle(time_s, np.full(501, 0.5), WHEEL_RADIUS_M)
    assert angle[-1] == pytest.approx(0.5 * 10.0 / WHEEL_RADIUS_M)


def test_caster_swings_round_on_a_tractrix():
    motion = base_motion(straight_log(speed_mps=0.5, end_time_s=1.0))
    velocity = motion.point_velocity(np.array([0.46, 0.18]))
    heading = trailing_heading(motion, velocity, trail_m=0.03, initial_rad=2.0)
    # Pulled along x from heading a: tan(a(t) / 2) = tan(a(0) / 2) exp(-v t / trail).
    expected = 2.0 * np.arctan(np.tan(1.0) * np.exp(-0.5 * motion.time_s / 0.03))
    np.testing.assert_allclose(heading, expected, atol=1e-12)


def test_caster_settles_across_the_radius_when_the_base_turns_on_the_spot():
    time_s = log_times(20.0)
    motion = base_motion(make_log(time_s, w_radps=0.5, yaw_rad=0.5 * time_s))
    pivot = np.array([0.40, 0.30])
    heading = trailing_heading(motion, motion.point_velocity(pivot), trail_m=0.03, initial_rad=0.0)
    # Distance of the pivot 0.5 m; steady where sin(e) |u| / trail = w, so sin(e) = 0.03 / 0.5.
    across = np.arctan2(0.40, -0.30)
    assert heading[-1] == pytest.approx(across - np.arcsin(0.03 / 0.5), abs=0.01)


def test_caster_does_not_move_while_the_base_stands():
    motion = base_motion(make_log(log_times(1.0)))
    heading = trailing_heading(
        motion, motion.point_velocity(np.array([0.4, 0.2])), trail_m=0.03, initial_rad=0.7
    )
    np.testing.assert_array_equal(heading, 0.7)


def wheel_angle(pose) -> float:
    """Returns the rotation about y, rad, within (-pi, pi]."""
    R = pose.rotation().matrix()
    return float(np.arctan2(R[0, 2], R[2, 2]))


def test_drive_wheels_roll_forward_together_on_a_straight_line(chair):
    motion = base_motion(straight_log(speed_mps=0.5, end_time_s=1.0))
    *_, last = chair.link_poses(motion, np.array([0.0, 1.0]))
    for link in ("left_wheel", "right_wheel"):
        assert wheel_angle(last[link]) == pytest.approx(0.5 * 1.0 / WHEEL_RADIUS_M)


def test_outer_wheel_rolls_farther_in_a_bend(chair):
    motion = base_motion(circle_log(radius_m=2.0, speed_mps=0.4, end_time_s=1.0))
    *_, last = chair.link_poses(motion, np.array([0.0, 1.0]))
    # To the left: the right wheel runs on a circle of 2 m plus half the track.
    outer = 0.4 / 2.0 * (2.0 + HALF_TRACK_M) / WHEEL_RADIUS_M
    inner = 0.4 / 2.0 * (2.0 - HALF_TRACK_M) / WHEEL_RADIUS_M
    assert wheel_angle(last["right_wheel"]) == pytest.approx(outer)
    assert wheel_angle(last["left_wheel"]) == pytest.approx(inner)


def test_casters_that_start_reversed_swing_round():
    chair = SdfModel(load_robot("wheelchair").model_path, [3.0, -3.0])
    motion = base_motion(straight_log(speed_mps=0.5, end_time_s=1.0))
    first, last = chair.link_poses(motion, np.array([0.0, 1.0]))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for poses, angle in ((first, sign * 3.0), (last, 0.0)):
            axis = poses[f"{side}_caster_fork"].rotation().matrix()[:2, 0]
            np.testing.assert_allclose(axis, [np.cos(angle), np.sin(angle)], atol=1e-3)


def test_casters_turn_round_when_the_chair_reverses(chair):
    time_s = log_times(20.0)
    motion = base_motion(make_log(time_s, v_mps=-0.3, w_radps=0.1, yaw_rad=0.1 * time_s))
    *_, last = chair.link_poses(motion, np.array([0.0, 20.0]))
    for side in ("left", "right"):
        fork, wheel = last[f"{side}_caster_fork"], last[f"{side}_caster_wheel"]
        trail = wheel.translation() - fork.translation()
        # Driving back, the wheel trails on the other side of its pivot: ahead.
        assert trail[0] > 0.8 * CASTER_TRAIL_M
        assert np.hypot(*trail[:2]) == pytest.approx(CASTER_TRAIL_M)
        assert wheel.translation()[2] == pytest.approx(CASTER_RADIUS_M)


def test_a_model_is_drawn_without_the_meshes_that_are_not_there(tmp_path):
    path = tmp_path / "cart.urdf"
    path.write_text(
        '<robot name="cart"><link name="base_link">'
        '<visual name="box"><geometry><box size="0.8 0.6 0.1"/></geometry></visual>'
        '<visual name="mast"><geometry><mesh filename="package://gone/mast.dae"/></geometry>'
        "</visual></link></robot>"
    )
    assert [visual.name for visual in SdfModel(path).visuals] == ["box"]


STL = (
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    "endloop\nendfacet\nendsolid a\n"
)


@pytest.mark.parametrize(
    ("stl", "extensions"),
    [(STL, [".obj"]), ("no mesh", [])],
)
def test_an_stl_mesh_that_is_only_seen_is_drawn_where_it_can_be_read(stl, extensions, tmp_path):
    (tmp_path / "hull.stl").write_text(stl)
    path = tmp_path / "cart.urdf"
    path.write_text(
        '<robot name="cart"><link name="base_link">'
        '<collision><geometry><box size="0.8 0.6 0.1"/></geometry></collision>'
        '<visual name="hull"><geometry><mesh filename="hull.stl"/></geometry></visual>'
        "</link></robot>"
    )
    assert [visual.shape.extension() for visual in SdfModel(path).visuals] == extensions


def test_a_model_has_the_colours_of_its_file(tmp_path):
    path = tmp_path / "cart.urdf"
    box = '<visual><geometry><box size="0.8 0.6 0.1"/></geometry><material name="{}">{}</material>'
    red, own = box.format("red", "") + "</visual>", '<color rgba="0 0.5 1 1"/>'
    path.write_text(
        f'<robot name="cart"><material name="red"><color rgba="1 0 0 1"/></material>'
        f'<link name="base_link">{red}{box.format("", own)}</visual></link></robot>'
    )
    assert [v.rgba for v in SdfModel(path).visuals] == [Rgba(1, 0, 0, 1), Rgba(0, 0.5, 1, 1)]


def test_of_a_thousand_equally_named_shapes_the_first_are_drawn_without_a_word(tmp_path, caplog):
    """Drake's parser took 31 s and 1 GB for 3,000, and warned of each."""
    path = tmp_path / "cart.urdf"
    box = '<visual name="a"><geometry><box size="0.8 0.6 0.1"/></geometry></visual>'
    path.write_text(f'<robot name="cart"><link name="base_link">{3000 * box}</link></robot>')
    assert len(SdfModel(path).visuals) == MAX_DRAWN
    assert caplog.records == []


def test_an_arm_of_a_model_does_not_roll_and_links_on_a_loop_or_alone_stay_where_they_are(tmp_path):
    """A joint with limits turns where its name says wheel or caster; loops of joints are cut."""
    path = tmp_path / "cart.urdf"
    link = '<link name="{}"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>'
    joint = (
        '<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/>'
        '<origin xyz="0 0 0.2"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>'
    )
    joints = [
        ("shoulder", "revolute", "base_link", "arm"),
        ("left_wheel", "revolute", "base_link", "wheel"),
        ("axle", "continuous", "base_link", "roller"),
        ("second", "fixed", "arm", "wheel"),
    ]
    links = ("base_link", "arm", "wheel", "roller", "alone")
    path.write_text(
        f'<robot name="cart">{"".join(map(link.format, links))}'
        f"{''.join(joint.format(*entry) for entry in joints)}</robot>"
    )
    model = SdfModel(path)
    assert model.moving_links == ("wheel", "roller")
    rest = model.rest_poses()
    assert set(rest) == set(links)
    assert rest["alone"].translation()[2] == pytest.approx(rest["base_link"].translation()[2])


def test_upholstery_takes_the_controllers_colour_and_nothing_else_does(chair):
    tinted = {visual.name for visual in chair.visuals if visual.rgba is None}
    assert {"upholstery_seat", "upholstery_back"} <= tinted
    assert all(name.startswith("upholstery") for name in tinted)


def test_robot_without_a_model_is_a_prism():
    model = PrismModel(load_robot("round_robot").outline)
    (visual,) = model.visuals
    assert isinstance(visual.shape, Convex)
    assert visual.rgba is None


# --- camera ---


@pytest.mark.parametrize("size", [(16.0, 3.0), (8.0, 9.0), (1.0, 12.0)])
def test_camera_shows_the_whole_course_and_no_more_than_it_must(size):
    course = Bounds(np.array([-1.0, -2.0]), np.array([-1.0, -2.0]) + size)
    position, target = camera_view(course)
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.array([1.0, 0.0, 0.0])
    up = np.cross(right, forward)
    corners = np.array([[*c, z] for c in course.corners for z in (0.0, 1.0)]) - position
    half_height = np.tan(np.deg2rad(CAMERA_FOV_DEG) / 2) * (corners @ forward)
    across = np.abs(corners @ right) / (CAMERA_ASPECT * half_height)
    along = np.abs(corners @ up) / half_height
    assert across.max() <= CAMERA_FILL_X + 1e-9
    assert along.max() <= CAMERA_FILL_Y + 1e-9
    tightest = max(across.max() / CAMERA_FILL_X, along.max() / CAMERA_FILL_Y)
    assert tightest == pytest.approx(1.0)


# --- animation ---


class WatchedStage(Stage):
    """Remembers the keys that it was given."""

    def __init__(self) -> None:
        super().__init__()
        self.keys: dict[str, list] = {}

    def pose(self, path, pose, frame=None) -> None:
        super().pose(path, pose, frame)
        if frame is not None:
            self.keys.setdefault(path, []).append((frame, pose))


def keys_of(log, **kwargs) -> list:
    stage = WatchedStage()
    model = PrismModel(load_robot("round_robot").outline)
    add_robot(
        stage,
        "/robot",
        model,
        base_motion(log),
        outline=load_robot("round_robot").outline,
        rgba=BLUE,
        **{"pose_stride": 1} | kwargs,
    )
    return stage.keys["/robot"]


def test_robot_is_where_the_log_says_at_every_frame():
    for frame, pose in keys_of(straight_log(speed_mps=0.5, end_time_s=2.0)):
        assert pose.translation()[0] == pytest.approx(0.5 * frame / FRAMES_PER_SECOND)


def test_robot_stays_where_it_ended():
    keys = keys_of(straight_log(speed_mps=0.5, end_time_s=2.0))
    frame, pose = keys[-1]
    assert frame == 2.0 * FRAMES_PER_SECOND
    assert pose.translation()[:2] == pytest.approx([1.0, 0.0])


def test_robot_that_ends_between_two_frames_shows_its_last_sample():
    end_time_s = 51 * LOG_PERIOD_S
    _, pose = keys_of(straight_log(speed_mps=0.5, end_time_s=end_time_s), pose_stride=3)[-1]
    # 1.02 s, shown by the frame of 1.0 s.
    assert pose.translation()[0] == pytest.approx(0.5 * 1.0)


def test_standing_robot_costs_one_key():
    assert len(keys_of(make_log(log_times(30.0)))) == 1


def test_robot_turns_through_pi_the_short_way():
    time_s = log_times(2.0)
    yaw = np.pi - 0.1 + 0.1 * time_s
    keys = keys_of(make_log(time_s, yaw_rad=yaw))
    turns = [pose.rotation() for _, pose in keys]
    steps = [(a.inverse() @ b).ToAngleAxis().angle() for a, b in pairwise(turns)]
    np.testing.assert_allclose(steps, 0.1 / FRAMES_PER_SECOND, atol=1e-9)


def test_frames_end_with_the_last_one():
    frames, times = frames_until(1.02, 8)
    assert frames.tolist() == [0, 8, 16, 20]
    assert times == pytest.approx([0.0, 0.4, 0.8, 1.0])


def test_events_keep_their_period_in_spite_of_rounding():
    events = [(0.1 * k, k) for k in range(31)]
    assert [event for _, event in spaced_in_time(events, 0.5)] == list(range(0, 31, 5))


def test_short_trials_are_shown_at_full_pace(chair):
    pace = Pace.fitting([30.0] * 5, chair, turn_period_s=0.5, max_turns=400)
    assert pace == Pace(pose_stride=1, turn_period_s=0.5)


def test_long_trials_keep_to_the_pages_size(chair):
    durations_s = [120.0] * 10
    pace = Pace.fitting(durations_s, chair, turn_period_s=0.5, max_turns=400)
    # Six links turn, each with a quarter of the base's keys.
    keys = sum(durations_s) * FRAMES_PER_SECOND * (1 + 6 / 4) / pace.pose_stride
    assert keys <= MAX_POSE_KEYS
    assert sum(durations_s) / pace.turn_period_s <= 400


def test_a_long_name_in_the_legend_breaks_between_its_words():
    row = LegendRow("dwb:sim_time=2.5<b>", "#000000", ["/robots/dwb"])
    assert "dwb:<wbr>sim_<wbr>time=<wbr>2.5&lt;b&gt;<" in row.markup()
