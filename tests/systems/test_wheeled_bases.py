"""Bases with motors, weight and casters: what must hold of both, and that they drive alike."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.systems.analysis import Simulator

from drake_navbench.inputs.robot import ROBOT_FILES, load_robot
from drake_navbench.trial.base_wiring import make_base
from drake_navbench.trial.open_loop import drive_open_loop

MULTIBODY, PLANAR = "wheelchair_multibody", "wheelchair_casters"
BOTH = [MULTIBODY, PLANAR]
# From when, s; v m/s, w rad/s: ahead, a turn, turning in place, back, a wide turn.
MANOEUVRE = [
    (0.0, 0.5, 0.0),
    (2.0, 0.3, 0.8),
    (4.0, 0.0, -1.0),
    (5.5, -0.4, 0.1),
    (7.0, 0.5, -0.3),
    (9.0, 0.0, 0.0),
]
REVERSED_RAD = 3.0


def chair(name, **drive):
    return load_robot(name, {"drive": drive} if drive else None)


def driven(robot, commands, until_s):
    """Returns (N, 6) the states from the start on, twenty a second."""
    time_s = np.linspace(0.0, until_s, round(20.0 * until_s) + 1)
    starts = np.array([start for start, *_ in commands])
    told = np.array([[v, w, 0.0] for _, v, w in commands])
    return drive_open_loop(robot, np.zeros(6), time_s, starts, told)


def yaw_after_straight_start(name, angles_rad, **drive):
    """Returns (largest, last) yaw rad of 3 s straight ahead from casters at angles."""
    casters = {"start_angles_rad": angles_rad} | drive.pop("casters", {})
    yaw = driven(chair(name, casters=casters, **drive), [(0.0, 0.5, 0.0)], 3.0)[:, 2]
    return yaw[np.abs(yaw).argmax()], yaw[-1]


@pytest.mark.parametrize("name", BOTH)
def test_what_gazebo_has_of_its_own_in_a_model_changes_nothing(name, tmp_path):
    sensor = '<sensor name="scan" type="gpu_lidar"><gz_frame_id>scan</gz_frame_id></sensor>'
    text = (ROBOT_FILES.folder / "wheelchair.sdf").read_text()
    (tmp_path / "wheelchair.sdf").write_text(text.replace("</link>", f"{sensor}</link>", 1))
    path = tmp_path / "chair.yaml"
    path.write_text(f"description: chair\nlike: {name}\nmodel: wheelchair.sdf\n")
    commands = [(0.0, 0.5, 0.3)]
    there = driven(load_robot(str(path)), commands, 0.5)
    np.testing.assert_array_equal(there, driven(chair(name), commands, 0.5))


class Rig:
    """A base by itself, under a command."""

    def __init__(self, robot, command=(0.0, 0.0)):
        self.base = make_base(robot, SceneGraph())
        self.simulator = Simulator(self.base)
        self.context = self.simulator.get_mutable_context()
        self.base.get_command_input_port().FixValue(self.context, np.array([*command, 0.0]))
        self.base.set_pose(self.context, np.zeros(3))

    def at(self, time_s):
        self.simulator.AdvanceTo(time_s)
        return self.base.get_state_output_port().Eval(self.context)


@pytest.mark.parametrize("name", BOTH)
@pytest.mark.parametrize(("v", "w"), [(0.5, 0.5), (0.2, -0.8), (-0.3, 0.3)])
def test_a_circle_has_the_radius_that_was_commanded(name, v, w):
    x, y = driven(chair(name), [(0.0, v, w)], 12.0)[60:, :2].T
    # x^2 + y^2 = 2 a x + 2 b y + c on the circle about (a, b).
    table = np.column_stack([2.0 * x, 2.0 * y, np.ones_like(x)])
    (a, b, c), *_ = np.linalg.lstsq(table, x**2 + y**2, rcond=None)
    assert np.sqrt(a**2 + b**2 + c) == pytest.approx(abs(v / w), rel=0.01)


def test_without_an_integral_part_a_load_slows_the_wheels():
    # What rolls and what pushes outwards on the circle turns the chair back.
    loose = chair(PLANAR, motors={"integral_nm": 0.0})
    w = driven(loose, [(0.0, 0.5, 0.5)], 8.0)[-1, 4]
    assert 0.45 < w < 0.49


@pytest.mark.parametrize("name", BOTH)
def test_half_the_step_ends_within_a_centimetre_after_ten_seconds(name):
    whole, half = (driven(chair(name, step_s=step), MANOEUVRE, 10.0)[-1] for step in (0.01, 0.005))
    assert np.hypot(*(whole - half)[:2]) < 0.01
    assert abs(whole[2] - half[2]) < 0.01


def test_energy_never_grows_at_zero_command():
    casters = {"start_angles_rad": [2.0, -1.0]}
    rig = Rig(chair(MULTIBODY, casters=casters, motors={"integral_nm": 0.0}))
    rig.base.set_state(rig.context, np.array([0.0, 0.0, 0.0, 0.5, 0.8, 0.0]))
    energies = [rig.base.energy_j(rig.context)]
    for step in range(1, 301):
        rig.at(0.01 * step)
        energies.append(rig.base.energy_j(rig.context))
    # 147 kg at 0.5 m/s alone are 18 J.
    assert energies[0] - energies[-1] > 18.0
    assert np.diff(energies).max() <= 0.0


def test_energy_of_the_planar_model_never_grows_at_zero_command():
    robot = chair(PLANAR, casters={"start_angles_rad": [2.0, -1.0]}, motors={"integral_nm": 0.0})
    gear = robot.running_gear("robot")
    rig = Rig(robot)
    rig.base.set_state(rig.context, np.array([0.0, 0.0, 0.0, 0.5, 0.8, 0.0]))
    turning_kg = gear.wheel_inertia_kgm2 / gear.wheel_radius_m**2
    mass_kg = gear.mass_kg + 2.0 * turning_kg
    inertia = gear.yaw_inertia_kgm2 + 0.5 * turning_kg * gear.wheel_separation_m**2
    states = np.array([rig.at(0.01 * step) for step in range(300)])
    energies = 0.5 * mass_kg * states[:, 3] ** 2 + 0.5 * inertia * states[:, 4] ** 2
    assert energies[0] > 18.0
    assert energies[-1] < 1e-6
    assert np.diff(energies).max() < 1e-9


@pytest.mark.parametrize("name", BOTH)
def test_standstill_stays_still(name):
    rig = Rig(chair(name, casters={"start_angles_rad": [1.0, -2.0]}))
    np.testing.assert_allclose(rig.at(10.0), np.zeros(6), atol=1e-3)
    start = rig.base.caster_angles(rig.context)
    np.testing.assert_allclose(start, [1.0, -2.0], atol=1e-2)


@pytest.mark.parametrize("name", BOTH)
def test_reversed_casters_kick_the_chair_on_a_straight_start(name):
    largest, last = yaw_after_straight_start(name, [REVERSED_RAD, REVERSED_RAD])
    # Torque on the chair while both swing round: 0.5 N m a swivel times arm by trail, 0.46 / 0.03,
    # and one more: 2 x 0.5 x 16.3 = 16 N m, for 0.1 to 0.3 s on the 354 N m s/rad of the motors.
    assert 0.005 < abs(largest) < 0.02
    # The integral part brings most of it back.
    assert abs(last) < 0.5 * abs(largest)
    trailing, _ = yaw_after_straight_start(name, [0.0, 0.0])
    assert abs(trailing) < 1e-5


@pytest.mark.parametrize("name", BOTH)
def test_casters_that_swing_to_opposite_sides_cancel(name):
    largest, _ = yaw_after_straight_start(name, [REVERSED_RAD, -REVERSED_RAD])
    assert abs(largest) < 1e-4


@pytest.mark.parametrize("name", BOTH)
def test_a_stiffer_swivel_kicks_harder(name):
    casters = {"swivel_friction_nm": 1.0}
    angles = [REVERSED_RAD, REVERSED_RAD]
    soft, _ = yaw_after_straight_start(name, angles)
    stiff, _ = yaw_after_straight_start(name, angles, casters=casters)
    # Twice the torque, and a chair that turns holds the casters across for longer.
    assert 1.8 < abs(stiff) / abs(soft) < 2.8


@pytest.mark.parametrize("name", BOTH)
def test_a_mirrored_start_drives_the_mirrored_way(name):
    angles = [2.0, 1.0]
    left = driven(chair(name, casters={"start_angles_rad": angles}), [(0.0, 0.4, 0.3)], 4.0)
    mirrored = {"start_angles_rad": [-angle for angle in reversed(angles)]}
    right = driven(chair(name, casters=mirrored), [(0.0, 0.4, -0.3)], 4.0)
    np.testing.assert_allclose(right * [1, -1, -1, 1, -1, -1], left, atol=1e-6)


@pytest.mark.parametrize("name", BOTH)
def test_casters_turn_to_trail(name):
    rig = Rig(chair(name, casters={"start_angles_rad": [2.0, -1.0]}), (0.5, 0.25))
    rig.at(5.0)
    # The swivels are at (0.46, +-0.18); about the centre of the circle at (0, 2) a caster points
    # along its way but for its trail: sin(e) = 0.03 m over the distance from that centre.
    for angle, y in zip(rig.base.caster_angles(rig.context), (0.18, -0.18), strict=True):
        along = np.arctan2(0.46, 2.0 - y)
        distance = np.hypot(0.46, 2.0 - y)
        assert angle == pytest.approx(along - np.arcsin(0.03 / distance), abs=0.01)


@pytest.mark.parametrize("name", BOTH)
def test_the_same_drive_gives_the_same_bytes(name):
    robot = chair(name, casters={"start_angles_rad": [2.0, 1.0]})
    first, second = (driven(robot, MANOEUVRE, 3.0) for _ in range(2))
    assert first.tobytes() == second.tobytes()


@pytest.mark.parametrize("name", BOTH)
def test_a_state_that_was_set_is_the_state(name):
    rig = Rig(chair(name))
    state = np.array([1.0, -2.0, 7.0, 0.3, -0.4, 0.0])
    rig.base.set_state(rig.context, state)
    told = rig.base.get_state_output_port().Eval(rig.context)
    np.testing.assert_allclose(told, state, atol=1e-12)
    pose = rig.base.get_geometry_pose_output_port().Eval(rig.context).value(rig.base.frame_id)
    np.testing.assert_allclose(pose.translation(), [1.0, -2.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("name", BOTH)
def test_the_wheels_go_on_as_they_were_set_to(name):
    rig = Rig(chair(name), (0.3, -0.4))
    rig.base.set_state(rig.context, np.array([0.0, 0.0, 0.0, 0.3, -0.4, 0.0]))
    for time_s in (0.05, 0.2, 0.5):
        np.testing.assert_allclose(rig.at(time_s)[3:5], [0.3, -0.4], atol=0.05)


def test_wheels_do_not_hold_each_other():
    # The ball of such a caster would reach into that of the driven wheel before it.
    long_trail = {"trail_m": 0.2}
    ends = [
        driven(chair(name, casters=long_trail), [(0.0, 0.4, 0.2)], 4.0)[-1, :3] for name in BOTH
    ]
    np.testing.assert_allclose(*ends, atol=0.02)
    assert np.hypot(*ends[0][:2]) > 1.3


# Three wheels: 20 kg, one caster behind, its wheel ahead of the swivel in the file; the axes of the
# left wheel, of the swivel and of the caster's wheel point the other way.
TRICYCLE = """<sdf version="1.9"><model name="tricycle">
<link name="base_link"><inertial><pose>-0.05 0 0.1 0 0 0</pose><mass>20</mass>
<inertia><ixx>0.4</ixx><iyy>0.5</iyy><izz>0.6</izz></inertia></inertial></link>
{wheels}
<link name="fork"><pose relative_to="base_link">-0.25 0 0.12 0 0 0</pose><inertial><mass>0.2</mass>
<inertia><ixx>0.001</ixx><iyy>0.001</iyy><izz>0.001</izz></inertia></inertial></link>
<joint name="swivel" type="continuous"><parent>base_link</parent><child>fork</child>
<axis><xyz>0 0 -1</xyz></axis></joint>
<link name="roller"><pose relative_to="fork">0.04 0 -0.07 0 0 0</pose>
<inertial><mass>0.2</mass>
<inertia><ixx>0.0003</ixx><iyy>0.0003</iyy><izz>0.0003</izz></inertia></inertial></link>
<joint name="roll" type="continuous"><parent>fork</parent><child>roller</child>
<axis><xyz>0 -1 0</xyz></axis></joint></model></sdf>"""
WHEEL = """<link name="{side}"><pose relative_to="base_link">0 {y} 0.1 0 0 0</pose><inertial>
<mass>1</mass><inertia><ixx>0.003</ixx><iyy>0.005</iyy><izz>0.003</izz></inertia></inertial></link>
<joint name="{side}_axle" type="continuous"><parent>base_link</parent><child>{side}</child>
<axis><xyz>0 {axis} 0</xyz></axis></joint>"""


def test_any_model_with_such_wheels_drives(tmp_path):
    wheels = WHEEL.format(side="left", y=0.2, axis=-1) + WHEEL.format(side="right", y=-0.2, axis=1)
    (tmp_path / "tricycle.sdf").write_text(TRICYCLE.format(wheels=wheels))
    ends = []
    for physics in ("multibody", "planar_casters", "ideal"):
        path = tmp_path / f"{physics}.yaml"
        path.write_text(
            "description: tricycle\nmodel: tricycle.sdf\nrobot_radius: 0.4\nmass_kg: 25.0\n"
            f"drive: {{physics: {physics}, casters: {{swivel_friction_nm: 0.1}}}}\n"
        )
        robot = load_robot(str(path))
        if physics != "ideal":
            rig = Rig(robot, (0.4, 0.2))
            assert rig.base.caster_angles(rig.context) == pytest.approx([0.0], abs=1e-3)
            rig.at(5.0)
            # A caster behind the axle points out of the bend, and trails by 0.04 m of 2.02 m.
            trailing = np.arctan2(-0.25, 2.0) - np.arcsin(0.04 / np.hypot(0.25, 2.0))
            assert rig.base.caster_angles(rig.context) == pytest.approx([trailing], abs=0.01)
        ends.append(driven(robot, [(0.0, 0.4, 0.2), (3.0, -0.3, 0.2)], 5.0)[-1, :3])
    np.testing.assert_allclose(ends[0], ends[1], atol=0.02)
    np.testing.assert_allclose(ends[1], ends[2], atol=0.05)


def test_weak_motors_need_longer():
    weak = chair(PLANAR, motors={"max_torque_nm": 6.0})
    weak_body = chair(MULTIBODY, motors={"max_torque_nm": 6.0})
    # 4 N m of each wheel are left: 2 x 4 / 0.24 m = 33 N less 7.6 N of rolling casters, on 153 kg.
    for robot in (weak, weak_body):
        assert driven(robot, [(0.0, 0.5, 0.0)], 1.0)[-1, 3] == pytest.approx(0.168, abs=0.01)


def test_a_dry_gear_makes_a_deadband():
    # 20 mm/s by 0.24 m by 140 N m s/rad push with 11.7 N m.
    stuck = {"integral_nm": 0.0, "dry_friction_nm": 14.0}
    for name in BOTH:
        v = driven(chair(name, motors=stuck), [(0.0, 0.02, 0.0)], 3.0)[-1, 3]
        assert v < 0.001 * 20.0


ALIKE = {
    "mixed": (MANOEUVRE, [0.0, 0.0]),
    "mixed, casters reversed": (MANOEUVRE, [3.0, 3.0]),
    "slalom": ([(k, 0.4, 0.6 * (-1) ** k) for k in range(10)], [0.0, 0.0]),
    "back and forth": ([(k, 0.4 * (-1) ** (k // 2), 0.0) for k in range(10)], [0.1, 0.2]),
}


@pytest.mark.parametrize("what", ALIKE)
def test_the_planar_model_drives_like_the_multibody(what):
    commands, angles = ALIKE[what]
    casters = {"start_angles_rad": angles}
    body, planar = (driven(chair(name, casters=casters), commands, 10.0) for name in BOTH)
    apart = body[-1] - planar[-1]
    # Ten seconds, up to four metres.
    assert np.hypot(*apart[:2]) < 0.02
    assert abs(apart[2]) < 0.02
    assert np.abs(body[:, 4] - planar[:, 4]).mean() < 0.02
