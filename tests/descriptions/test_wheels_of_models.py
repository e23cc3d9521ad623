"""The wheels of a model: where their tyres are, how large, and how fast they may turn."""

from __future__ import annotations

import math

import pytest
import trimesh

from drake_navbench.inputs.check import Status
from drake_navbench.inputs.described_robot import describe_robot
from drake_navbench.inputs.descriptions.body import base_of, wheels_of
from drake_navbench.inputs.descriptions.drive_kinds import DIFFERENTIAL, OMNIDIRECTIONAL
from drake_navbench.inputs.descriptions.gazebo_drive import drive_of
from drake_navbench.inputs.descriptions.model_source import read_source
from drake_navbench.inputs.package_files import ROBOT
from drake_navbench.inputs.package_search import find_package_files
from drake_navbench.inputs.robot import load_robot

BODY = (
    '<link name="base_link"><collision><geometry><box size="0.6 0.4 0.2"/></geometry></collision>'
    "</link>"
)
CYLINDER = '<cylinder radius="{}" length="0.04"/>'


def wheel(name, y, *geometries, offset=0.0):
    """A wheel whose joint is at y, and its shapes by offset further along the axle."""
    shapes = "".join(
        f'<collision><origin xyz="0 {offset} 0" rpy="1.5708 0 0"/><geometry>{text}</geometry>'
        "</collision>"
        for text in geometries
    )
    return (
        f'<link name="{name}_wheel">{shapes}</link><joint name="{name}_joint" type="continuous">'
        f'<parent link="base_link"/><child link="{name}_wheel"/><origin xyz="0 {y} -0.05"/>'
        '<axis xyz="0 1 0"/></joint>'
    )


def robot(folder, *parts, name="cart.urdf"):
    path = folder / name
    path.write_text(f'<robot name="a">{BODY}{"".join(parts)}</robot>')
    return path


def drive(path):
    source = read_source(path)
    wheels = wheels_of(source.model, base_of(source.model))
    return drive_of(source.model, wheels, source.packages)


def test_the_separation_is_that_of_the_tyres_not_of_the_joints(tmp_path):
    """As of Leo: the joint is at the outer face, the tyre 0.04 m further in; hub and tyre."""
    shapes = (CYLINDER.format(0.057), CYLINDER.format(0.0625))
    path = robot(
        tmp_path,
        wheel("left", 0.22, *shapes, offset=-0.04),
        wheel("right", -0.22, *shapes, offset=0.04),
    )
    values = drive(path).values
    assert values["wheel_separation_m"] == pytest.approx(0.36)
    assert values["wheel_radius_m"] == pytest.approx(0.0625)


def test_wheels_that_roll_along_y_of_the_base_frame_are_told(tmp_path):
    """As drawing programs leave it: the axle along x, wheels at x = 0.17 and -0.17 m."""
    parts = [wheel(side, 0, CYLINDER.format(0.05)) for side in ("left", "right")]
    across = [
        text.replace('xyz="0 0 -0.05"', f'xyz="{x} 0 -0.05"').replace('"0 1 0"', '"1 0 0"')
        for text, x in zip(parts, (0.17, -0.17), strict=True)
    ]
    path = robot(tmp_path, *across)
    assert drive(path).values["wheel_separation_m"] == pytest.approx(0.34)
    (row,) = [r for r in describe_robot(path).check.rows if r.status is Status.DOUBTFUL]
    assert row.remark == (
        "roll along y of base_link, where ROS commands along its x; here they roll along x"
    )


def test_more_than_two_wheels_may_be_mecanum_wheels_of_another_name(tmp_path):
    pair = [wheel(side, y, CYLINDER.format(0.05)) for side, y in (("left", 0.2), ("right", -0.2))]
    rear = [text.replace("_wheel", "_rear_wheel").replace("_joint", "_rear_joint") for text in pair]
    for parts, may_be in ((pair, False), (pair + rear, True)):
        found = drive(robot(tmp_path, *parts))
        assert (found.kind, found.may_roll_sideways) == (DIFFERENTIAL, may_be)


def test_the_acceleration_of_ros_1_s_plugin_is_that_of_its_wheels_rims(tmp_path):
    plugin = (
        '<gazebo><plugin filename="libgazebo_ros_diff_drive.so" name="d">'
        "<wheelAcceleration>1.8</wheelAcceleration></plugin></gazebo>"
    )
    parts = [wheel(side, y, CYLINDER.format(0.05)) for side, y in (("left", 0.2), ("right", -0.2))]
    assert drive(robot(tmp_path, *parts, plugin)).values["max_linear_acceleration_mps2"] == 1.8


def steered(rear_m, front_m):
    """The wheels of a steered base: two on the rear axle, one in front that turns by 0.398 rad."""
    knuckle = (
        '<link name="knuckle"/><joint name="steer" type="revolute"><parent link="base_link"/>'
        f'<child link="knuckle"/><origin xyz="{front_m} 0 0"/><axis xyz="0 0 1"/>'
        '<limit lower="-0.5" upper="0.398" effort="1" velocity="1"/></joint>'
    )
    front = wheel("front", 0.2, CYLINDER.format(0.1)).replace('"base_link"', '"knuckle"')
    rear = [wheel(side, y, CYLINDER.format(0.1)) for side, y in (("left", 0.2), ("right", -0.2))]
    joint = '_wheel"/><origin xyz="'
    return *(text.replace(f"{joint}0 ", f"{joint}{rear_m} ") for text in rear), knuckle, front


def test_a_small_wheel_between_two_larger_ones_stands_for_them_and_is_none(tmp_path):
    """As controllers of cars want it; one that is not in the middle of the two is a wheel."""
    pair = [wheel(side, y, CYLINDER.format(0.1)) for side, y in (("left", 0.2), ("right", -0.2))]
    path = robot(tmp_path, wheel("rear", 0.0, CYLINDER.format(0.025)), *pair)
    model = read_source(path).model
    assert [found.radius_m for found in wheels_of(model, "base_link")] == pytest.approx([0.1, 0.1])
    path = robot(tmp_path, wheel("rear", 0.1, CYLINDER.format(0.025)), *pair)
    assert len(wheels_of(read_source(path).model, "base_link")) == 3


@pytest.mark.parametrize(
    ("plugin", "radius_m"),
    [
        ('<plugin filename="libackermann.so" name="a"><max_steer>0.6</max_steer></plugin>', 0.585),
        ('<plugin filename="libackermann.so" name="a"/>', 0.951),
        ("", 0.951),
    ],
)
def test_a_steered_base_turns_as_far_as_its_wheels_allow(tmp_path, plugin, radius_m):
    """Axles 0.4 m apart, steered by 0.6 rad as the plugin tells, else by 0.4 as the joints do.

    Without a plugin, the steering joint alone tells that the base is steered.

    0.4 m / tan(0.6) = 0.585 m; 0.4 m / tan(0.398) = 0.951 m.
    """
    found = drive(robot(tmp_path, *steered(rear_m=0.0, front_m=0.4), f"<gazebo>{plugin}</gazebo>"))
    assert found.kind == "ackermann"
    values = found.values
    assert values["wheelbase_m"] == pytest.approx(0.4)
    assert values["min_turning_radius_m"] == pytest.approx(radius_m, abs=1e-3)


def test_a_steered_base_turns_about_its_rear_axle_wherever_the_base_frame_is(tmp_path):
    for rear_m, front_m, told in (
        (-0.3, 0.25, "0.3 m behind the base frame; the base turns about it"),
        (0.1, 0.65, "0.1 m ahead of the base frame; the base turns about it"),
        (0.0, 0.55, None),
    ):
        found = describe_robot(robot(tmp_path, *steered(rear_m, front_m), name=f"{rear_m}.urdf"))
        fields = found.fields["drive"]
        assert fields["wheelbase_m"] == pytest.approx(0.55)
        assert fields.get("rear_axle_x_m", 0.0) == pytest.approx(rear_m)
        rows = [row.remark for row in found.check.rows if row.parameter == "rear axle"]
        assert rows == ([told] if told else [])


@pytest.mark.parametrize(
    ("steered_by", "wheels", "rear_m"),
    [
        # Four wheels that no joint of the model steers: the rearmost axle does not either.
        ("", [("a", -0.3, 0.2), ("b", -0.3, -0.2), ("c", 0.25, 0.2), ("d", 0.25, -0.2)], -0.3),
        # The plugin names the joint, which turns without end in the model: a front wheel steers.
        ("front_joint", [("a", -0.3, 0.2), ("b", -0.3, -0.2)], -0.3),
        ("", [], None),
    ],
)
def test_a_car_of_its_plugin_alone_turns_about_its_rear_axle_or_it_is_told(
    tmp_path, steered_by, wheels, rear_m
):
    joint = '_wheel"/><origin xyz="'
    parts = [
        wheel(name, y, CYLINDER.format(0.1)).replace(f"{joint}0 ", f"{joint}{x} ")
        for name, x, y in wheels
    ]
    if steered_by:
        front = wheel("front", 0.0, CYLINDER.format(0.1)).replace(f"{joint}0 ", f"{joint}0.25 ")
        parts.append(front.replace('axis xyz="0 1 0"', 'axis xyz="0 0 1"'))
    plugin = (
        '<gazebo><plugin filename="gz-sim-ackermann-steering-system" name="a">'
        f"<left_steering_joint>{steered_by}</left_steering_joint>"
        "<wheel_base>0.55</wheel_base><steering_limit>0.5</steering_limit></plugin></gazebo>"
    )
    found = describe_robot(robot(tmp_path, *parts, plugin))
    fields = found.fields["drive"]
    assert (fields["type"], fields.get("rear_axle_x_m")) == ("ackermann", rear_m)
    # 0.55 m / tan(0.5 rad)
    assert fields["min_turning_radius_m"] == pytest.approx(1.007, abs=1e-3)
    told = [row.remark for row in found.check.rows if row.parameter == "rear axle"]
    assert told == (
        ["not told by the model; the base turns about its frame's origin"]
        if rear_m is None
        else ["0.3 m behind the base frame; the base turns about it"]
    )


def test_a_wheel_that_is_fixed_to_a_steered_part_is_steered(tmp_path):
    """As of a forklift: a gear box hangs on the steered bearing, and the wheel on the gear box."""
    left, right, knuckle, front = steered(rear_m=0.0, front_m=0.55)
    gear = (
        '<link name="gear"/><joint name="hangs" type="fixed"><parent link="knuckle"/>'
        '<child link="gear"/></joint>'
    )
    parts = (
        left,
        right,
        knuckle,
        gear,
        front.replace('parent link="knuckle"', 'parent link="gear"'),
    )
    found = drive(robot(tmp_path, *parts))
    assert found.kind == "ackermann"
    assert found.values["rear_axle_x_m"] == pytest.approx(0.0)
    assert found.values["min_turning_radius_m"] == pytest.approx(1.308, abs=1e-3)


def test_joints_that_a_plugin_drives_are_wheels_whatever_their_language(tmp_path):
    parts = [
        wheel(name, y, CYLINDER.format(0.1)).replace("_wheel", "_teker")
        for name, y in (("sol", 0.2), ("sag", -0.2), ("kepce", 0.0))
    ]
    plugin = (
        '<gazebo><plugin filename="libgazebo_ros_diff_drive.so" name="d">'
        "<leftJoint>sol_joint</leftJoint><rightJoint>sag_joint</rightJoint></plugin></gazebo>"
    )
    found = drive(robot(tmp_path, *parts, plugin))
    assert found.values["wheel_radius_m"] == pytest.approx(0.1)
    assert found.values["wheel_separation_m"] == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("size", "radius_m"), [("0.04 0.2 0.2", 0.1), ("0.2 0.04 0.2", 0.1), ("0.04 0.2 0.1", None)]
)
def test_a_box_with_two_equal_long_sides_is_a_tyre(tmp_path, size, radius_m):
    parts = [wheel(n, y, f'<box size="{size}"/>') for n, y in (("left", 0.2), ("right", -0.2))]
    assert drive(robot(tmp_path, *parts)).values.get("wheel_radius_m") == radius_m


def test_joints_whose_speed_ros2_control_commands_are_wheels_whatever_their_name(tmp_path):
    """As of a tutorial's drivewhl_l_link; the controllers file tells separation and limits."""
    parts = [
        f'<link name="drivewhl_{side}"><collision><geometry><sphere radius="0.1"/></geometry>'
        f'</collision></link><joint name="{side}_joint" type="continuous">'
        f'<parent link="base_link"/><child link="drivewhl_{side}"/><origin xyz="0 {y} 0"/>'
        '<axis xyz="0 1 0"/></joint>'
        for side, y in (("l", 0.28), ("r", -0.28))
    ]
    spun = '<joint name="{}"><command_interface name="velocity"/></joint>'
    control = "".join(spun.format(f"{side}_joint") for side in "lr")
    (tmp_path / "base_controllers.yaml").write_text(
        "manager: {ros__parameters: {base: {type: diff_drive_controller/DiffDriveController}}}\n"
        "base: {ros__parameters: {left_wheel_names: [l_joint], right_wheel_names: [r_joint],\n"
        "  wheel_separation: 0.55, linear.x.max_velocity: 0.5}}\n"
    )
    found = drive(robot(tmp_path, *parts, f'<ros2_control name="c">{control}</ros2_control>'))
    assert (found.kind, found.source) == (DIFFERENTIAL, "base_controllers.yaml")
    assert found.values["wheel_separation_m"] == 0.55
    assert found.values["max_linear_velocity_mps"] == 0.5
    assert found.values["wheel_radius_m"] == pytest.approx(0.1)


def test_a_plugins_bounds_for_driving_bound_turning_too(tmp_path):
    """As Gazebo's DiffDrive reads them; a bound of its own prevails."""
    plugin = (
        '<gazebo><plugin filename="gz-sim-diff-drive-system" name="d">'
        "<max_velocity>2.0</max_velocity><max_acceleration>10</max_acceleration>{}"
        "</plugin></gazebo>"
    )
    values = drive(robot(tmp_path, plugin.format(""))).values
    assert (values["max_linear_velocity_mps"], values["max_angular_velocity_radps"]) == (2.0, 2.0)
    assert values["max_angular_acceleration_radps2"] == 10.0
    own = plugin.format("<max_angular_velocity>1.5</max_angular_velocity>")
    assert drive(robot(tmp_path, own)).values["max_angular_velocity_radps"] == 1.5


def test_wheels_that_a_plugin_turns_and_the_model_fixes_are_told(tmp_path):
    plugin = (
        '<gazebo><plugin filename="libgazebo_ros_diff_drive.so" name="d">'
        "<left_joint>left_joint</left_joint><right_joint>right_joint</right_joint>"
        "<wheel_separation>0.4</wheel_separation></plugin></gazebo>"
    )
    fixed = wheel("left", 0.2, CYLINDER.format(0.1)).replace("continuous", "fixed")
    path = robot(tmp_path, fixed, wheel("right", -0.2, CYLINDER.format(0.1)), plugin)
    rows = {row.parameter: row.remark for row in describe_robot(path).check.rows}
    assert "left_joint: fixed, so Gazebo's plugin cannot turn them" in str(rows)
    assert "right_joint: fixed" not in str(rows)


def test_a_link_that_a_urdf_has_twice_is_told(tmp_path):
    mast = '<link name="mast"/>'
    joint = '<joint name="m" type="fixed"><parent link="base_link"/><child link="mast"/></joint>'
    (remark,) = read_source(robot(tmp_path, mast, mast, joint)).model.remarks
    assert remark == "link mast: described more than once, which ROS refuses; the last one counts"


def test_a_label_of_a_plugin_tells_no_drive(tmp_path):
    plugin = '<gazebo><plugin filename="libgazebo_ros_{}.so" name="mecanum_bot"/></gazebo>'
    wheels = [wheel(n, y, CYLINDER.format(0.1)) for n, y in (("left", 0.2), ("right", -0.2))]
    for file, source in (("p3d", "2 wheels"), ("diff_drive", "libgazebo_ros_diff_drive.so")):
        found = drive(robot(tmp_path, *wheels, plugin.format(file)))
        assert (found.kind, found.source) == ("differential", source)


def test_springs_do_not_steer_and_a_drivers_wheel_is_none(tmp_path):
    """The left rear wheel hangs on a spring of 0.05 m; the driver's wheel is 0.9 m up, in front."""
    left, right, *front = steered(rear_m=-0.3, front_m=0.25)
    spring = (
        '<link name="axle"/><joint name="spring" type="prismatic"><parent link="base_link"/>'
        '<child link="axle"/><axis xyz="0 0 1"/>'
        '<limit lower="-0.05" upper="0.05" effort="1" velocity="1"/></joint>'
    )
    driver = wheel("steering", 0.0, CYLINDER.format(0.1)).replace('"0 0.0 -0.05"', '"0.2 0 0.9"')
    parts = (left.replace('"base_link"', '"axle"'), right, *front, spring, driver)
    fields = describe_robot(robot(tmp_path, *parts)).fields["drive"]
    assert (fields["type"], fields["wheelbase_m"]) == ("ackermann", pytest.approx(0.55))
    # 0.55 m / tan(0.398 rad); a spring of 0.05 m read as 0.05 rad would give 11 m.
    assert fields["min_turning_radius_m"] == pytest.approx(1.308, abs=1e-3)
    assert fields["rear_axle_x_m"] == pytest.approx(-0.3)


def test_the_radius_of_a_mesh_is_measured_where_the_mesh_is_round(tmp_path):
    trimesh.creation.cylinder(radius=0.05, height=0.03).export(tmp_path / "round.stl")
    trimesh.creation.box((0.3, 0.1, 0.03)).export(tmp_path / "fender.stl")
    for file, radius_m in (("round.stl", 0.05), ("fender.stl", None)):
        mesh = f'<mesh filename="{file}"/>'
        parts = (wheel("left", 0.2, mesh), wheel("right", -0.2, mesh))
        values = drive(robot(tmp_path, *parts)).values
        assert values.get("wheel_radius_m") == (radius_m and pytest.approx(radius_m, rel=1e-3))
        assert values["wheel_separation_m"] == pytest.approx(0.4)


@pytest.mark.parametrize(("bound", "speed_mps"), [("1.0", None), ("5", 0.5)])
def test_the_bound_of_ros2_controls_examples_is_left_out_and_told(tmp_path, bound, speed_mps):
    def commanded(name):
        return (
            f'<joint name="{name}_joint"><command_interface name="velocity">'
            f'<param name="min">-{bound}</param><param name="max">{bound}</param>'
            "</command_interface></joint>"
        )

    wheels = [wheel(n, y, CYLINDER.format(0.1)) for n, y in (("left", 0.2), ("right", -0.2))]
    control = f'<ros2_control name="a">{commanded("left")}{commanded("right")}</ros2_control>'
    path = robot(tmp_path, *wheels, control)
    assert drive(path).values.get("max_linear_velocity_mps") == speed_mps
    told = "bound of 1 rad/s on the wheels is its examples' and not used"
    assert (told in describe_robot(path).check.as_text(200)) == (speed_mps is None)


def test_of_two_models_in_a_folder_the_one_with_a_drive_comes_first(tmp_path):
    wheels = [wheel(n, y, CYLINDER.format(0.1)) for n, y in (("left", 0.2), ("right", -0.2))]
    robot(tmp_path, *wheels, name="leo.urdf")
    plugin = '<gazebo><plugin filename="libdiff-drive-system.so" name="d"/></gazebo>'
    simulated = robot(tmp_path, *wheels, plugin, name="leo_sim.urdf")
    assert find_package_files([tmp_path]).files[ROBOT][0] == simulated


def turned(name, yaw_rad, x, y):
    """A wheel at x, y whose axle is turned by a yaw."""
    text = wheel(name, y, CYLINDER.format(0.05))
    return text.replace(f'xyz="0 {y} -0.05"', f'xyz="{x} {y} -0.05" rpy="0 0 {yaw_rad}"')


@pytest.mark.parametrize(
    ("yaws_deg", "kind"),
    [((90, 210, 330), OMNIDIRECTIONAL), ((45, 135, 225, 315), OMNIDIRECTIONAL), ((0, 0, 90), "")],
)
def test_wheels_that_point_in_many_directions_are_omni_wheels(tmp_path, yaws_deg, kind):
    """Three wheels at 120 degrees, four in a cross; two wheels with a third across are neither."""
    wheels = []
    for number, yaw in enumerate(math.radians(y) for y in yaws_deg):
        wheels.append(turned(f"w{number}", yaw, 0.2 * math.sin(yaw), 0.1 * number))
    assert drive(robot(tmp_path, *wheels)).kind == (kind or DIFFERENTIAL)


@pytest.mark.parametrize(
    ("trail_m", "kind"), [(0.0, OMNIDIRECTIONAL), (0.05, DIFFERENTIAL)], ids=["swerve", "caster"]
)
def test_wheels_that_all_turn_about_their_own_middle_are_a_swerve_drive(tmp_path, trail_m, kind):
    """A wheel 0.05 m behind its upright joint is a caster's."""
    parts = []
    for name, x, y in (("fl", 0.2, 0.2), ("fr", 0.2, -0.2), ("rear", -0.2, 0.0)):
        rolling = wheel(name, 0, CYLINDER.format(0.1)).replace('"base_link"', f'"{name}_leg"')
        parts += (
            f'<link name="{name}_leg"/><joint name="{name}_turn" type="revolute">'
            f'<parent link="base_link"/><child link="{name}_leg"/><origin xyz="{x} {y} 0"/>'
            '<axis xyz="0 0 1"/><limit lower="-3.14159" upper="3.14159" effort="1" velocity="1"/>'
            "</joint>",
            rolling.replace('"0 0 -0.05"', f'"-{trail_m} 0 -0.05"'),
        )
    assert drive(robot(tmp_path, *parts)).kind == kind


def test_wheels_that_a_plugin_tells_otherwise_than_the_model_are_doubtful(tmp_path):
    """Links 0.4 m apart; a plugin of 0.41 m is near enough, one of 0.2 m is not."""
    wheels = [wheel(n, y, CYLINDER.format(0.1)) for n, y in (("left", 0.2), ("right", -0.2))]
    plugin = (
        '<gazebo><plugin filename="libdiff_drive.so" name="d"><wheel_separation>{}'
        "</wheel_separation></plugin></gazebo>"
    )
    assert drive(robot(tmp_path, *wheels, plugin.format(0.41))).differs == ""
    path = robot(tmp_path, *wheels, plugin.format(0.2))
    said = "separation 0.2 m, that of the model's wheels is 0.4 m"
    assert drive(path).differs == said
    # By its wheels' speeds, v -+ 0.1 m w, the base stands below a deadband.
    assert load_robot(str(path)).actuators.wheel_separation_m == 0.2
    assert f"libdiff_drive.so gives {said}" in describe_robot(path).check.as_text(300)
    # With four wheels, which skid, another separation may be meant, another radius is not.
    more = [wheel(n, y, CYLINDER.format(0.1)) for n, y in (("back_l", 0.2), ("back_r", -0.2))]
    values = "0.2</wheel_separation><wheel_radius>0.3</wheel_radius><wheel_separation>0.2"
    path = robot(tmp_path, *wheels, *more, plugin.format(values))
    assert drive(path).differs == "radius 0.3 m, that of the model's wheels is 0.1 m"


def test_a_plugin_that_moves_the_body_reads_nothing_of_its_wheels(tmp_path):
    """Copies of a mecanum plugin keep its wheels' values, which planar_move does not have."""
    wheels = [wheel(n, y, CYLINDER.format(0.1)) for n, y in (("left", 0.2), ("right", -0.2))]
    plugin = (
        '<gazebo><plugin filename="libgazebo_ros_planar_move.so" name="d">'
        "<wheel_radius>0.04</wheel_radius><wheel_separation>0.6</wheel_separation>"
        "</plugin></gazebo>"
    )
    found = drive(robot(tmp_path, *wheels, plugin))
    assert found.kind == "omnidirectional"
    assert found.differs == ""
    assert found.values["wheel_radius_m"] == pytest.approx(0.1)
    assert found.values["wheel_separation_m"] == pytest.approx(0.4)


def test_a_plugin_that_flies_is_no_drive(tmp_path):
    plugin = (
        '<gazebo><plugin filename="libmulticopter-velocity-control.so" name="d"/></gazebo>'
        '<gazebo><plugin filename="libdiff-drive-system.so" name="e"/></gazebo>'
    )
    wheels = [wheel(n, y, CYLINDER.format(0.1)) for n, y in (("left", 0.2), ("right", -0.2))]
    assert drive(robot(tmp_path, *wheels, plugin)).kind == DIFFERENTIAL


@pytest.mark.parametrize("caster", ["front_caster", "front_castor"])
def test_the_wheel_of_a_caster_is_none_however_it_is_spelt(tmp_path, caster):
    names = (("left", 0.2), ("right", -0.2), (caster, 0.0))
    path = robot(tmp_path, *(wheel(n, y, CYLINDER.format(0.1)) for n, y in names))
    source = read_source(path)
    assert len(wheels_of(source.model, base_of(source.model))) == 2


def test_the_length_of_an_axis_is_no_matter(tmp_path):
    """Axes of the length 0.5: the front wheels steer as with unit vectors."""
    parts = [part.replace('xyz="0 0 1"', 'xyz="0 0 0.5"') for part in steered(-0.3, 0.25)]
    assert any('xyz="0 0 0.5"' in part for part in parts)
    assert drive(robot(tmp_path, *parts)).kind == "ackermann"


def test_ros2_control_may_bound_the_steering_more_than_its_joints(tmp_path):
    """Axles 0.4 m apart; joints turn by 1.2 rad, commands by 0.6: 0.4 m / tan(0.6) = 0.585 m."""
    steering = (
        '<link name="{0}"/><joint name="{0}_joint" type="revolute"><parent link="base_link"/>'
        '<child link="{0}"/><origin xyz="0.4 {1} 0"/><axis xyz="0 0 1"/>'
        '<limit lower="-1.2" upper="1.2" velocity="1" effort="1"/></joint>'
    )
    parts = [wheel(n, y, CYLINDER.format(0.1)) for n, y in (("left", 0.2), ("right", -0.2))]
    control = ""
    for side, y in (("knuckle_left", 0.2), ("knuckle_right", -0.2)):
        front = wheel(f"front_{side}", 0.0, CYLINDER.format(0.1))
        parts += [
            steering.format(side, y),
            front.replace('parent link="base_link"', f'parent link="{side}"'),
        ]
        control += (
            f'<joint name="{side}_joint"><command_interface name="position">'
            '<param name="max">0.6</param></command_interface></joint>'
        )
    found = drive(robot(tmp_path, *parts, f'<ros2_control name="c">{control}</ros2_control>'))
    assert found.kind == "ackermann"
    assert found.values["min_turning_radius_m"] == pytest.approx(0.585, abs=1e-3)


@pytest.mark.parametrize(("ahead_m", "is_told"), [(0.0, False), (0.1, True)])
def test_wheels_away_from_the_base_frame_are_told(tmp_path, ahead_m, is_told):
    """A base turns about the middle of its wheels; here it does so about the frame's origin."""
    parts = [wheel(n, y, CYLINDER.format(0.1)) for n, y in (("left", 0.2), ("right", -0.2))]
    parts = [part.replace('origin xyz="0 0.2 -', f'origin xyz="{ahead_m} 0.2 -') for part in parts]
    parts = [part.replace('origin xyz="0 -0.2', f'origin xyz="{ahead_m} -0.2') for part in parts]
    told = describe_robot(robot(tmp_path, *parts)).check.as_text(300)
    assert ("the middle of its wheels is at 0.1, 0 m" in told) is is_told
