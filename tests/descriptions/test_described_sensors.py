"""Where a model's lidars and cameras are, and what they see."""

from __future__ import annotations

import math

import pytest
from descriptions_scenes import BOX, XACRO, link, rows, urdf, write_repository

from drake_navbench.inputs.check import Status
from drake_navbench.inputs.described_robot import describe_robot
from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.known_base import known_base_of

EYE = (
    '<joint name="j" type="fixed"><parent link="base_link"/><child link="eye"/>'
    '<origin xyz="0.1 0.05 0.4" rpy="{rpy}"/></joint><link name="eye"/>'
)


def sensor(kind: str, body: str) -> str:
    return f'<gazebo reference="eye"><sensor name="eye" type="{kind}">{body}</sensor></gazebo>'


def test_a_depth_camera_looks_down_as_the_model_says(tmp_path):
    camera = (
        "<camera><horizontal_fov>1.2</horizontal_fov><image><width>640</width>"
        "<height>480</height></image><clip><near>0.2</near><far>4</far></clip></camera>"
    )
    body = link(BOX) + EYE.format(rpy="0 0.3 0") + sensor("depth_camera", camera)
    found = load_robot(str(urdf(tmp_path, body))).depth_sensors["eye"]
    assert found.pitch_rad == pytest.approx(0.3, abs=1e-4)
    assert found.horizontal_fov_rad == pytest.approx(1.2)
    # tan(v / 2) = tan(0.6) x 480 / 640
    assert found.vertical_fov_rad == pytest.approx(2 * math.atan(0.75 * math.tan(0.6)), abs=1e-4)
    assert (found.range_min_m, found.range_max_m) == (0.2, 4.0)


def test_a_lidar_upside_down_counts_its_angles_the_other_way(tmp_path):
    ray = (
        "<ray><scan><horizontal><samples>90</samples><min_angle>-0.5</min_angle>"
        "<max_angle>1.5</max_angle></horizontal></scan><range><max>5</max></range></ray>"
    )
    body = link(BOX) + EYE.format(rpy="3.1415926 0 0") + sensor("ray", ray)
    lidar = load_robot(str(urdf(tmp_path, body))).lidar
    assert lidar.angle_min_rad == pytest.approx(-1.5, abs=1e-4)
    assert lidar.angle_span_rad == pytest.approx(2.0)


def test_a_lidar_may_scan_from_the_larger_angle_to_the_smaller_one(tmp_path):
    ray = (
        "<ray><scan><horizontal><samples>90</samples><min_angle>0</min_angle>"
        "<max_angle>-1.5</max_angle></horizontal></scan><range><max>5</max></range></ray>"
    )
    path = urdf(tmp_path, link(BOX) + EYE.format(rpy="0 0 0") + sensor("ray", ray))
    lidar = load_robot(str(path)).lidar
    assert (lidar.angle_min_rad, lidar.angle_span_rad) == pytest.approx((-1.5, 1.5))
    # 1.5 rad = 85.9 degrees
    assert any("90 beams over 86 degrees" in row for row in rows(path, Status.USED))


@pytest.mark.parametrize(("resolution", "beams"), [("0.5", 45), ("-1", 90), ("5000", 90)])
def test_a_lidar_has_its_resolution_times_as_many_beams_where_that_is_possible(
    tmp_path, resolution, beams
):
    ray = (
        f"<ray><scan><horizontal><samples>90</samples><resolution>{resolution}</resolution>"
        "</horizontal></scan><range><max>5</max></range></ray>"
    )
    path = urdf(tmp_path, link(BOX) + EYE.format(rpy="0 0 0") + sensor("ray", ray))
    assert load_robot(str(path)).lidar.beam_count == beams


@pytest.mark.parametrize(
    ("rpy", "pitch_rad", "remark"),
    [
        ("0 0 0", -0.4, ""),
        ("3.1415926 0 0", 0.4, "hangs upside down: its upper layers look down"),
        ("0 0.5 0", -0.4, "tilted; here it stands level"),
    ],
)
def test_a_lidar_of_many_layers_upside_down_looks_down(tmp_path, rpy, pitch_rad, remark):
    """Its layers reach from 0.1 rad below the level to 0.9 rad above: 0.4 rad up in the middle."""
    ray = (
        "<lidar><scan><horizontal><samples>360</samples></horizontal><vertical><samples>32"
        "</samples><min_angle>-0.1</min_angle><max_angle>0.9</max_angle></vertical></scan></lidar>"
    )
    path = urdf(tmp_path, link(BOX) + EYE.format(rpy=rpy) + sensor("gpu_lidar", ray))
    found = load_robot(str(path)).depth_sensors["eye"]
    assert found.pitch_rad == pytest.approx(pitch_rad)
    # Without angles, as here, it sees all around.
    assert found.horizontal_fov_rad == pytest.approx(2.0 * math.pi)
    assert any(remark in row for status in Status for row in rows(path, status))


@pytest.mark.parametrize(
    ("samples", "reach_m", "is_lidar"), [(16, 1.0, True), (16, 0.9, False), (15, 1.0, False)]
)
def test_a_ray_sensor_of_few_beams_or_short_reach_is_no_lidar(tmp_path, samples, reach_m, is_lidar):
    ray = (
        f"<ray><scan><horizontal><samples>{samples}</samples></horizontal></scan>"
        f"<range><max>{reach_m}</max></range></ray>"
    )
    path = urdf(tmp_path, link(BOX) + EYE.format(rpy="0 0 0") + sensor("ray", ray))
    assert (load_robot(str(path)).lidar.beam_count == 16) == is_lidar
    told = [row for row in rows(path, Status.NO_MEANING) if "eye (proximity)" in row]
    assert bool(told) != is_lidar


def test_two_lidars_of_a_kind_scan_together_and_of_two_kinds_the_first(tmp_path):
    path = write_repository(tmp_path)
    second = XACRO[XACRO.index('<gazebo reference="laser">') : XACRO.index("<gazebo><plugin")]
    second = second.replace('name="front"', 'name="rear"').replace(
        "<update", "<pose>-0.4 0 0 0 0 3.14159265</pose><update"
    )
    path.write_text(XACRO.replace("<gazebo><plugin", f"{second}<gazebo><plugin"))
    assert load_robot(str(path)).lidar.further_poses[0][0] == pytest.approx(-0.2)
    noisy = second.replace("<stddev>0.02<", "<stddev>0.05<")
    path.write_text(XACRO.replace("<gazebo><plugin", f"{noisy}<gazebo><plugin"))
    lidar = load_robot(str(path)).lidar
    assert (len(lidar.further_poses), lidar.range_std_m) == (1, 0.05)
    other = second.replace("<max>8</max>", "<max>20</max>")
    path.write_text(XACRO.replace("<gazebo><plugin", f"{other}<gazebo><plugin"))
    assert not load_robot(str(path)).lidar.further_poses
    assert any("of another kind than front" in row for row in rows(path, Status.STAND_IN))


def test_a_lidar_above_two_metres_is_seen_by_the_costmaps(tmp_path):
    mast = '<joint name="j" type="fixed"><parent link="base_link"/><child link="laser"/>'
    top = f'{link("", "laser")}{mast}<origin xyz="0 0 2.3"/></joint>'
    path = urdf(tmp_path, link(BOX) + top)
    navigation = load_robot(str(path)).navigation
    # The floor is 0.1 m below the base link.
    for costmap in (navigation.local_costmap, navigation.global_costmap):
        layer = costmap.obstacle_layer
        assert layer.max_obstacle_height == pytest.approx(2.4)
        assert layer.observation_sources["scan"].max_obstacle_height == pytest.approx(2.4)
        assert layer.observation_sources["scan"].clearing
    assert any("look up to 2.4 m" in row for row in rows(path, Status.OTHER_FORM))


def test_without_a_lidar_the_default_one_is_where_its_link_is(tmp_path):
    """The rod that holds it comes first, and is no lidar."""
    places = {"lidar_rod": "0.1 0 0.2", "laser": "0.2 0 0.35"}
    laser = "".join(
        link("", name) + f'<joint name="to_{name}" type="fixed"><parent link="base_link"/>'
        f'<child link="{name}"/><origin xyz="{place}" rpy="0 0 3.14159"/></joint>'
        for name, place in places.items()
    )
    path = urdf(tmp_path, link(BOX) + laser)
    lidar = load_robot(str(path)).lidar
    assert lidar.pose == pytest.approx((0.2, 0.0, 3.14159))
    # The box reaches from -0.1 to 0.1 m: its underside is the floor.
    assert lidar.height_m == pytest.approx(0.45)
    assert any("the default one where the link laser is" in r for r in rows(path, Status.STAND_IN))


@pytest.mark.parametrize(
    ("pitch", "has_laser", "lidar"),
    [
        # The camera is 0.4 m over the box's middle, so 0.5 m over its underside.
        ("0", False, {"pose": (0.1, 0.05, 0.0), "height_m": 0.5, "angle_span_rad": 1.2}),
        # Its view of 0.95 rad up and down holds nothing level any more.
        ("0.6", False, {"pose": (0.0, 0.0, 0.0)}),
        ("0", True, {"pose": (0.2, 0.0, 0.0), "height_m": 0.45}),
    ],
)
def test_a_depth_camera_scans_level_where_no_lidar_and_no_link_of_one_is(
    tmp_path, pitch, has_laser, lidar
):
    camera = (
        "<camera><horizontal_fov>1.2</horizontal_fov><image><width>640</width>"
        "<height>480</height></image><clip><near>0.2</near><far>4</far></clip></camera>"
    )
    laser = link("", "laser") + (
        '<joint name="l" type="fixed"><parent link="base_link"/><child link="laser"/>'
        '<origin xyz="0.2 0 0.35"/></joint>'
    )
    body = link(BOX) + EYE.format(rpy=f"0 {pitch} 0") + sensor("depth_camera", camera)
    path = urdf(tmp_path, body + (laser if has_laser else ""))
    found = load_robot(str(path))
    assert "eye" in found.depth_sensors
    for name, value in lidar.items():
        assert getattr(found.lidar, name) == pytest.approx(value)
    (told,) = (row for row in rows(path, Status.STAND_IN) if "lidar: none described" in row)
    is_camera = "angle_span_rad" in lidar
    assert ("the depth camera eye scans level, over 69 degrees" in told) == is_camera
    if is_camera:
        assert (found.lidar.angle_min_rad, found.lidar.range_max_m) == (-0.6, 4.0)


def test_an_argument_that_leaves_the_lidar_out_is_named(tmp_path):
    path = tmp_path / "cart.urdf.xacro"
    path.write_text(
        '<robot name="cart" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        f'<xacro:arg name="lidar_enabled" default="false"/>{link(BOX)}</robot>'
    )
    told = rows(path, Status.STAND_IN)
    assert any("at the base; --set lidar_enabled=true may add one" in row for row in told)


def test_a_sensor_of_a_link_that_is_not_there_is_left_out_and_told(tmp_path):
    path = urdf(tmp_path, link(BOX) + sensor("depth", "<update_rate>10</update_rate>"))
    robot = load_robot(str(path))
    assert not robot.depth_sensors
    assert any(
        "left out the sensor eye: the model has no link eye" in r
        for r in rows(path, Status.STAND_IN)
    )


@pytest.mark.parametrize(("topic", "range_m"), [("/robot1/rear/scan", 8.0), ("scan", 5.0)])
def test_of_two_lidars_the_one_counts_that_the_costmaps_listen_to(tmp_path, topic, range_m):
    """Gazebo's own form of a topic, and the plugin's of classic Gazebo."""
    front = (
        "<ray><range><max>5</max></range></ray><plugin filename='a' name='b'><ros><remapping>"
        "~/out:=scan</remapping></ros></plugin>"
    )
    rear = "<topic>rear/scan</topic><ray><range><max>8</max></range></ray>"
    sensors = sensor("ray", front), sensor("gpu_lidar", rear).replace('name="eye"', 'name="back"')
    path = urdf(tmp_path, link(BOX) + EYE.format(rpy="0 0 0") + "".join(sensors))
    nav2 = tmp_path / "nav2.yaml"
    nav2.write_text(
        "local_costmap: {local_costmap: {ros__parameters: {plugins: [walls], walls: "
        f"{{observation_sources: eyes, eyes: {{topic: {topic}}}}}}}}}}}\n"
    )
    known = known_base_of([nav2])
    assert known.scans == (topic,)
    lidar = load_robot(str(path), known=known).lidar
    assert (lidar.range_max_m, lidar.further_poses) == (range_m, ())
    told = describe_robot(path, known=known).check.as_text(300)
    assert f"left out: the Nav2 file's costmaps listen to {topic}, not to its topic" in told
    assert load_robot(str(path)).lidar.range_max_m == 5.0
