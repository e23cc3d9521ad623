"""Wheels and casters of a robot file and its model: what is read, and what is refused."""

from __future__ import annotations

import re

import numpy as np
import pytest
from nav2_setups import read_nav2_files

from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import ROBOT_FILES, load_robot, overridden

WHEELCHAIR_SDF = ROBOT_FILES.folder / "wheelchair.sdf"


def refused(tmp_path, text, *, sdf=None):
    """Returns the one line with which a robot file is refused."""
    if sdf is not None:
        (tmp_path / "chair.sdf").write_text(sdf)
    path = tmp_path / "chair.yaml"
    path.write_text(f"description: chair\nlike: wheelchair\n{text}")
    with pytest.raises(InputError) as caught:
        load_robot(str(path))
    line = str(caught.value)
    assert "\n" not in line
    return line


def test_the_wheelchair_has_the_wheels_of_its_model():
    gear = load_robot("wheelchair_multibody").running_gear("robot")
    assert gear.axles == ("left_wheel_axle", "right_wheel_axle")
    assert (gear.wheel_radius_m, gear.wheel_separation_m) == pytest.approx((0.24, 0.54))
    assert gear.wheel_inertia_kgm2 == pytest.approx(9.0 * 0.24**2 / 2)
    assert [caster.swivel for caster in gear.casters] == [
        "left_caster_swivel",
        "right_caster_swivel",
    ]
    for caster, y in zip(gear.casters, (0.18, -0.18), strict=True):
        assert (caster.x_m, caster.y_m, caster.trail_m) == pytest.approx((0.46, y, 0.03))
        assert (caster.radius_m, caster.rest_rad) == pytest.approx((0.08, 0.0))


def test_the_weight_is_that_of_the_chair_and_what_it_carries():
    gear = load_robot("wheelchair_multibody").running_gear("robot")
    assert gear.mass_kg == pytest.approx(144.0)
    assert gear.load_kg == pytest.approx(144.0 - 69.2)
    # 48 kg at 0.12 m, casters of 0.6 kg at 0.445 m and 1 kg at 0.43 m twice, 74.8 kg at 0.2 m.
    ahead = (48 * 0.12 + 1.2 * 0.445 + 2.0 * 0.43 + 74.8 * 0.2) / 144
    assert gear.center_m[0] == pytest.approx(ahead)
    # In balance about the axle both casters carry what is ahead of it.
    assert 2 * gear.caster_load_n * 0.46 == pytest.approx(144 * 9.81 * ahead)


def test_payload_is_weight_too():
    robot = load_robot("wheelchair_casters", {"actuators": {"payload_kg": 20.0}})
    assert robot.running_gear("robot").mass_kg == pytest.approx(164.0)


def test_a_robot_file_may_move_the_casters():
    casters = {"trail_m": 0.06, "positions": [[0.4, 0.2], [0.4, -0.2]]}
    robot = load_robot("wheelchair_casters", {"drive": {"casters": casters}})
    left, right = robot.running_gear("robot").casters
    assert (left.x_m, left.y_m, left.trail_m) == (0.4, 0.2, 0.06)
    assert (right.x_m, right.y_m, right.trail_m) == (0.4, -0.2, 0.06)


def test_another_model_makes_another_trial(tmp_path):
    sdf = WHEELCHAIR_SDF.read_text()
    path = tmp_path / "chair.yaml"
    hashes = []
    for physics in ("ideal", "planar_casters"):
        for mass in ("48", "50"):
            path.write_text(f"description: chair\nlike: wheelchair\nmodel: chair_{mass}.sdf\n")
            text = sdf.replace("<mass>48</mass>", f"<mass>{mass}</mass>")
            (tmp_path / f"chair_{mass}.sdf").write_text(text)
            robot = load_robot(str(path), {"drive": {"physics": physics}})
            hashes.append(tuple(robot.file_hashes.values()))
    # What is only to be seen changes no trial.
    assert hashes[:2] == [(), ()]
    assert len(set(hashes[2:])) == 2


def test_ideal_wheels_say_nothing_of_themselves():
    told = load_robot("wheelchair").model_dump(mode="json")["drive"]
    assert not {"physics", "motors", "casters", "floor", "step_s"} & told.keys()
    assert load_robot("wheelchair_casters").model_dump(mode="json")["drive"]["physics"] == (
        "planar_casters"
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "drive: {physics: rolling}",
            r"drive\.differential\.physics: .*'multibody', got 'rolling'",
        ),
        (
            "drive: {physics: multibody, casters: {trail_m: -0.03}}",
            r"casters\.trail_m: .* greater than or equal to 0\.01, got -0\.03",
        ),
        (
            "drive: {physics: multibody, step_s: 0.05}",
            r"step_s: .* less than or equal to 0\.02, got 0\.05",
        ),
        (
            "drive: {physics: planar_casters, casters: {positions: [[0.46, 0.18], [1.2, -0.18]]}}",
            r"drive\.casters\.positions\[1\]: .* \[1\.2, -0\.18\] lies outside",
        ),
        (
            "drive: {physics: planar_casters, casters: {positions: [[0.46, 0.18]]}}",
            r"drive\.casters\.positions: got 1, the model has 2 casters",
        ),
        (
            "drive: {physics: multibody, casters: {start_angles_rad: [0, 0, 0]}}",
            r"drive\.casters\.start_angles_rad: got 3, the model has 2 casters",
        ),
        ("mass_kg: 50.0\ndrive: {physics: multibody}", r"mass_kg: got 50 kg, .* weigh 69\.2 kg"),
        ("mass_kg: 0.0\ndrive: {physics: multibody}", r"mass_kg: .* greater than 0, got 0"),
        (
            "drive: {physics: multibody, load_position: [-0.3, 0, 0.6]}",
            r"drive\.load_position: .* centre of mass is at \[-0\.\d+, .*no wheel holds it",
        ),
        (
            "model: null\ndrive: {physics: multibody}",
            r"drive\.physics: multibody takes the wheels from a model; expected an SDF or URDF",
        ),
        ("model: none.sdf\ndrive: {physics: multibody}", r"model: no such file: .*none\.sdf"),
        (
            "drive: {type: omnidirectional, physics: planar_casters}",
            r"physics: only a drive of type differential",
        ),
        ("drive: {motors: {max_torque_nm: 0}}", r"motors\.max_torque_nm: .* greater than 0, got 0"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(tmp_path, text, expected):
    line = refused(tmp_path, text)
    assert str(tmp_path / "chair.yaml") in line
    assert re.search(expected, line), line


@pytest.mark.parametrize(
    ("joints", "expected"),
    [
        (["left_wheel_axle"], r"expected two driven wheels, .* found right_wheel_axle at"),
        (["left_wheel_axle", "right_wheel_axle"], r"expected two driven wheels, .* found none"),
        (["left_caster_swivel", "right_caster_swivel"], r"expected casters: .* found none"),
    ],
)
def test_a_model_without_its_joints_is_refused_in_one_line(tmp_path, joints, expected):
    sdf = WHEELCHAIR_SDF.read_text()
    for name in joints:
        sdf = re.sub(rf'<joint name="{name}".*?</joint>', "", sdf, flags=re.S)
    line = refused(tmp_path, "model: chair.sdf\ndrive: {physics: multibody}", sdf=sdf)
    assert str(tmp_path / "chair.sdf") in line
    assert re.search(expected, line), line


def test_a_caster_without_trail_is_refused(tmp_path):
    sdf = WHEELCHAIR_SDF.read_text().replace('fork">-0.03 0 -0.16', 'fork">0 0 -0.16')
    line = refused(tmp_path, "model: chair.sdf\ndrive: {physics: planar_casters}", sdf=sdf)
    assert "left_caster_axle: expected the wheel of a caster at least 0.01 m behind" in line


def test_a_base_link_that_hangs_on_another_is_refused(tmp_path):
    footprint = """<link name="base_footprint"/><joint name="up" type="fixed">
        <parent>base_footprint</parent><child>base_link</child></joint></model>"""
    sdf = WHEELCHAIR_SDF.read_text().replace("</model>", footprint)
    line = refused(tmp_path, "model: chair.sdf\ndrive: {physics: multibody}", sdf=sdf)
    assert "expected base_link to be the first link" in line
    assert "below base_footprint" in line


def test_a_file_of_several_models_is_refused(tmp_path):
    sdf = WHEELCHAIR_SDF.read_text()
    other = "<model name='other'><link name='box'/></model></sdf>"
    line = refused(
        tmp_path,
        "model: chair.sdf\ndrive: {physics: multibody}",
        sdf=sdf.replace("</sdf>", other),
    )
    assert str(tmp_path / "chair.sdf") in line


def test_a_model_that_is_none_is_refused(tmp_path):
    line = refused(tmp_path, "model: chair.sdf\ndrive: {physics: multibody}", sdf="<sdf")
    assert re.search(r"chair\.sdf: is not XML: ", line)


def test_a_link_with_an_inertia_that_no_body_has_is_refused(tmp_path):
    sdf = WHEELCHAIR_SDF.read_text().replace("<iyy>2.880</iyy>", "<iyy>28.80</iyy>")
    line = refused(tmp_path, "model: chair.sdf\ndrive: {physics: multibody}", sdf=sdf)
    assert "link base_link: no body of 48 kg has the inertia 2.214, 28.8, 2.214 kg m^2" in line


def test_a_link_with_a_negative_mass_is_refused(tmp_path):
    sdf = WHEELCHAIR_SDF.read_text().replace("<mass>48</mass>", "<mass>-48</mass>")
    line = refused(tmp_path, "model: chair.sdf\ndrive: {physics: multibody}", sdf=sdf)
    assert line.endswith(
        "link base_link: no body of -48 kg has the inertia 2.214, 2.88, 2.214 kg m^2"
    )


def test_a_link_may_be_called_as_a_joint_s_parent(tmp_path):
    link = """<link name="left_caster_swivel_parent"/><joint name="mark" type="fixed">
        <parent>base_link</parent><child>left_caster_swivel_parent</child></joint></model>"""
    sdf = WHEELCHAIR_SDF.read_text().replace("</model>", link)
    (tmp_path / "chair.sdf").write_text(sdf)
    path = tmp_path / "chair.yaml"
    path.write_text("description: chair\nlike: wheelchair_multibody\nmodel: chair.sdf\n")
    assert len(load_robot(str(path)).running_gear("robot").casters) == 2


def test_an_override_that_needs_wheels_is_refused_where_there_are_none():
    with pytest.raises(InputError, match=r"^--sweep: drive\.physics: multibody takes the wheels"):
        overridden(load_robot("turtlebot4"), {"drive": {"physics": "multibody"}}, "--sweep")


def test_an_override_of_a_base_without_casters_is_refused():
    overrides = {"drive": {"physics": "planar_casters"}}
    with pytest.raises(
        InputError, match=r"physics: only a drive of type differential .* 'omnidirectional'"
    ):
        overridden(load_robot("omni_robot"), overrides, "--sweep")


@pytest.mark.parametrize(
    ("front_m", "fault"), [(0.9, None), (0.4, r"nav2\.yaml: drive\.casters\.positions\[0\]: ")]
)
def test_a_nav2_file_with_another_outline_keeps_the_wheels(tmp_path, front_m, fault):
    path = tmp_path / "nav2.yaml"
    corners = [[front_m, 0.3], [front_m, -0.3], [-0.25, -0.3], [-0.25, 0.3]]
    path.write_text(
        "controller_server:\n  ros__parameters:\n    controller_plugins: [FollowPath]\n"
        "    FollowPath: {plugin: nav2_regulated_pure_pursuit_controller::"
        "RegulatedPurePursuitController}\n"
        "local_costmap:\n  local_costmap:\n    ros__parameters:\n"
        f'      footprint: "{corners}"\n'
    )
    base = load_robot("wheelchair_casters")
    if fault is not None:
        with pytest.raises(InputError, match=fault):
            read_nav2_files([path], base, "wheelchair_casters")
        return
    robot = read_nav2_files([path], base, "wheelchair_casters").robot
    assert robot.drive.physics == "planar_casters"
    assert robot.model_path == base.model_path
    assert robot.outline[0, 0] == front_m


class TestLike:
    """A robot file may say which other one it is like."""

    def test_fields_hold_where_the_file_has_none(self, tmp_path):
        path = tmp_path / "slow.yaml"
        path.write_text(
            "description: slow\nlike: wheelchair\ndrive: {max_linear_velocity_mps: 0.3}"
        )
        slow, usual = load_robot(str(path)), load_robot("wheelchair")
        assert slow.drive.max_linear_velocity_mps == 0.3
        assert slow.navigation == usual.navigation
        assert slow.model_path.samefile(usual.model_path)
        np.testing.assert_array_equal(slow.outline, usual.outline)

    def test_chains_lead_to_the_first(self, tmp_path):
        (tmp_path / "a.yaml").write_text("description: a\nlike: b.yaml\nmass_kg: 150.0")
        (tmp_path / "b.yaml").write_text("description: b\nlike: jackal\nmass_kg: 140.0")
        robot = load_robot(str(tmp_path / "a.yaml"))
        assert (robot.description, robot.mass_kg) == ("a", 150.0)
        assert robot.drive == load_robot("jackal").drive

    @pytest.mark.parametrize(
        ("text", "expected"),
        [
            ("like: wheelchar", "like: robot file .*wheelchar: no such file"),
            ("like: robot.yaml", "like: 'robot.yaml' is like this file itself"),
            ("like: 7", "like: expected the name or file of a robot, got 7"),
            ("like: [a]", "like: expected the name or file of a robot"),
        ],
    )
    def test_what_leads_nowhere_is_refused(self, tmp_path, text, expected):
        path = tmp_path / "robot.yaml"
        path.write_text(f"description: robot\n{text}")
        with pytest.raises(InputError, match=expected) as caught:
            load_robot(str(path))
        assert "\n" not in str(caught.value)

    def test_an_override_is_not_like_anything(self):
        with pytest.raises(InputError, match="like: only a robot file"):
            load_robot("wheelchair", {"like": "jackal"})
