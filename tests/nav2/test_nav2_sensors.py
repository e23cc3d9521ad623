"""Which sensor sends to an observation source of a Nav2 file, and what it is if it is added."""

import pytest
from nav2_texts import COLUMN, LOCAL, SEEING, row_of

STVL = "spatio_temporal_voxel_layer/SpatioTemporalVoxelLayer"
MARK = "mark: {topic: /eye, obstacle_range: 3.0}"
CLEAR = (
    "clear: {topic: /eye, marking: false, clearing: true, max_z: 15.0, model_type: 1, "
    "horizontal_fov_angle: 1.0, vertical_fov_angle: 0.8}"
)


@pytest.mark.parametrize("order", ["mark clear", "clear mark"])
def test_a_sensor_has_what_all_of_its_sources_tell_whatever_their_order(setup_of, order):
    setup = setup_of(
        COLUMN, LOCAL % (SEEING % (STVL, f"observation_sources: {order}, {MARK}, {CLEAR}"))
    )
    sensor = setup.robot.depth_sensors["eye"]
    assert (sensor.horizontal_fov_rad, sensor.vertical_fov_rad) == (1.0, 0.8)
    assert sensor.range_max_m == 15.0
    sources = setup.robot.navigation.local_costmap.plugin_blocks["obstacles"].observation_sources
    assert {source.sensor for source in sources.values()} == {"eye"}
    remarks = {row_of(setup, f"obstacles.{name}.topic").remark for name in ("mark", "clear")}
    assert len(remarks) == 1
    assert "of 1 x 0.8 rad and 15 m" in remarks.pop()


@pytest.mark.parametrize("first", ["local", "global"])
def test_a_sensor_has_what_the_sources_of_both_costmaps_tell(setup_of, first):
    text = "{rolling_window: true, plugins: [obstacles], obstacles: {plugin: %s, %s}}"
    marks = text % (STVL, f"observation_sources: mark, {MARK}")
    clears = text % (STVL, f"observation_sources: clear, {CLEAR}")
    local, world = (marks, clears) if first == "local" else (clears, marks)
    setup = setup_of(
        COLUMN,
        f"local_costmap: {{local_costmap: {{ros__parameters: {local}}}}}\n"
        f"global_costmap: {{global_costmap: {{ros__parameters: {world}}}}}\n",
    )
    sensor = setup.robot.depth_sensors["eye"]
    assert (sensor.horizontal_fov_rad, sensor.range_max_m) == (1.0, 15.0)


@pytest.mark.parametrize(
    ("names", "model_type", "looks_around"),
    [
        ("velodyne", "", True),
        ("velodyne", "model_type: 0", False),
        ("front_camera", "", False),
        ("front_camera", "model_type: 1", True),
    ],
)
def test_a_source_says_what_its_sensor_is_or_else_its_name_does(
    setup_of, names, model_type, looks_around
):
    layer = f"observation_sources: {names}, {names}: {{clearing: true, {model_type}}}"
    sensor = setup_of(COLUMN, LOCAL % (SEEING % (STVL, layer))).robot.depth_sensors[names]
    assert (sensor.horizontal_fov_rad > 6.0) is looks_around


@pytest.mark.parametrize(
    ("topic", "sensors"),
    [("/camera/obstacles", ["eye"]), ("/left_obstacles", ["eye", "left_obstacles"])],
)
def test_points_sorted_out_of_a_robot_s_only_camera_are_that_camera_s(
    setup_of, tmp_path, topic, sensors
):
    """rtabmap sends the points of the floor and of obstacles apart; a side is another camera's."""
    robot = tmp_path / "seeing.yaml"
    robot.write_text("description: r\nrobot_radius: 0.2\ndepth_sensors: {eye: {height_m: 0.9}}\n")
    floor = "a: {data_type: PointCloud2, topic: /camera/ground}"
    other = f"b: {{data_type: PointCloud2, topic: {topic}}}"
    layer = SEEING % ("nav2_costmap_2d::VoxelLayer", f"observation_sources: a b, {floor}, {other}")
    setup = setup_of(COLUMN, LOCAL % layer, base=str(robot))
    assert sorted(setup.robot.depth_sensors) == sensors


@pytest.mark.parametrize(
    ("name", "yaw"), [("right_camera", -1.5708), ("upright_camera", 0.0), ("bright_camera", 0.0)]
)
def test_a_side_is_a_word_and_no_part_of_upright(setup_of, name, yaw):
    layer = f"observation_sources: {name}, {name}: {{clearing: true}}"
    sensor = setup_of(COLUMN, LOCAL % (SEEING % (STVL, layer))).robot.depth_sensors[name]
    assert sensor.pose[2] == pytest.approx(yaw, abs=1e-4)
