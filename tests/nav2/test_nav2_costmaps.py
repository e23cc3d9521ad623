"""Costmaps of a Nav2 file: layers, and sensors for the sources they listen to."""

import pytest
from nav2_texts import COLUMN, LOCAL, SEEING, row_of

from drake_navbench.inputs.check import Status


def test_a_source_that_no_layer_listens_to_is_told(setup_of):
    scan = "max_obstacle_height: 2.0, clearing: true"
    sources = f"observation_sources: a, a: {{{scan}}}, b: {{{scan}}}"
    setup = setup_of(COLUMN, LOCAL % (SEEING % ("nav2_costmap_2d::VoxelLayer", sources)))
    assert row_of(setup, "obstacles.b").status == Status.UNREAD


@pytest.mark.parametrize(("radius_m", "is_small"), [(0.29, True), (0.3, False)])
def test_costs_that_do_not_reach_as_far_as_the_robot_are_doubtful(setup_of, radius_m, is_small):
    inflation = (
        f"inflate: {{plugin: 'nav2_costmap_2d::InflationLayer', inflation_radius: {radius_m}}}"
    )
    costmap = f"rolling_window: true, robot_radius: 0.29, plugins: [inflate], {inflation}"
    # Nav2 makes the circle a polygon of 16 corners and pads it by 0.01 m.
    row = row_of(setup_of(COLUMN, LOCAL % costmap), "inflate.inflation_radius")
    assert row.status == (Status.DOUBTFUL if is_small else Status.USED)
    assert ("less than the robot's inscribed radius, 0.2942 m" in row.remark) == is_small


def test_lyricals_legacy_inflation_layer_is_taken_whole(setup_of):
    legacy = "nav2_costmap_2d::LegacyInflationLayer"
    inflation = f"inflate: {{plugin: '{legacy}', inflation_radius: 0.7}}"
    setup = setup_of(COLUMN, LOCAL % f"rolling_window: true, plugins: [inflate], {inflation}")
    layer = setup.robot.navigation.local_costmap.inflation_layer
    assert (layer.plugin, layer.inflation_radius) == (legacy, 0.7)
    assert row_of(setup, "inflate.inflation_radius").status == Status.USED


@pytest.mark.parametrize("kind", ["ObstacleLayer", "VoxelLayer"])
def test_a_camera_that_the_robot_does_not_have_is_put_where_its_lidar_is(setup_of, kind):
    points = "topic: /rear_camera/points, data_type: PointCloud2, obstacle_max_range: 7.5"
    camera = f"observation_sources: c, c: {{{points}}}"
    setup = setup_of(COLUMN, LOCAL % (SEEING % (f"nav2_costmap_2d::{kind}", camera)))
    costmap = setup.robot.navigation.local_costmap
    assert costmap.plugins == ["obstacles"]
    assert costmap.plugin_blocks["obstacles"].observation_sources["c"].sensor == (
        "rear_camera_points"
    )
    (sensor,) = setup.robot.depth_sensors.values()
    assert sensor.range_max_m == 7.5
    assert sensor.pose == pytest.approx((0.0, 0.0, 3.14159265))
    row = row_of(setup, "obstacles.c.topic")
    assert row.status == Status.OTHER_FORM
    assert "depth_sensors.rear_camera_points in a robot file says otherwise" in row.remark
    assert setup.check.is_whole


def test_a_camera_of_the_robot_is_taken_by_the_name_of_its_source(setup_of, tmp_path):
    robot = tmp_path / "seeing.yaml"
    robot.write_text("description: r\nrobot_radius: 0.2\ndepth_sensors: {oak: {height_m: 0.9}}\n")
    source = "observation_sources: oak, oak: {data_type: PointCloud2, topic: /points}"
    text = LOCAL % (SEEING % ("nav2_costmap_2d::VoxelLayer", source))
    setup = setup_of(COLUMN, text, base=str(robot))
    assert list(setup.robot.depth_sensors) == ["oak"]
    assert row_of(setup, "obstacles.oak.topic").remark == "the robot's depth sensor oak"


@pytest.mark.parametrize(
    ("names", "degrees"),
    [
        ("front_camera", 0), ("left", 90), ("cam_right", -90), ("back", 180), ("frontleft", 45),
        ("rear_right_depth", -135),
    ],
)  # fmt: skip
def test_a_camera_looks_where_its_name_says(setup_of, names, degrees):
    source = f"observation_sources: {names}, {names}: {{data_type: PointCloud2}}"
    setup = setup_of(COLUMN, LOCAL % (SEEING % ("nav2_costmap_2d::VoxelLayer", source)))
    (sensor,) = setup.robot.depth_sensors.values()
    assert sensor.pose[2] == pytest.approx(degrees * 3.14159265 / 180.0)


def test_a_lidar_of_many_layers_looks_all_around(setup_of):
    source = "observation_sources: p, p: {data_type: PointCloud2, topic: /velodyne_points}"
    setup = setup_of(COLUMN, LOCAL % (SEEING % ("nav2_costmap_2d::VoxelLayer", source)))
    assert setup.robot.depth_sensors["velodyne_points"].horizontal_fov_rad == pytest.approx(
        6.2831853
    )


TWO_SCANS = (
    "observation_sources: a b, a: {topic: /a, clearing: true, max_obstacle_height: 2.0},"
    " b: {topic: /b, max_obstacle_height: 2.0, obstacle_max_range: 1.0}"
)


@pytest.mark.parametrize("span_rad", ["6.28", "6.283185307179586"])
def test_a_lidar_that_sees_all_around_is_every_scanner(setup_of, tmp_path, span_rad):
    robot = tmp_path / "round.yaml"
    lidar = f"lidar: {{angle_span_rad: {span_rad}}}"
    robot.write_text(f"description: r\nrobot_radius: 0.2\n{lidar}\n")
    text = LOCAL % (SEEING % ("nav2_costmap_2d::ObstacleLayer", TWO_SCANS))
    setup = setup_of(COLUMN, text, base=str(robot))
    sources = setup.robot.navigation.local_costmap.plugin_blocks["obstacles"].observation_sources
    assert {name: source.scanner for name, source in sources.items()} == {"a": None, "b": None}
    assert (sources["b"].obstacle_max_range, sources["b"].clearing) == (1.0, False)
    assert setup.check.is_whole


def test_two_scanners_of_the_robot_are_two_sources(setup_of, tmp_path):
    robot = tmp_path / "two.yaml"
    robot.write_text(
        "description: r\nrobot_radius: 0.2\nlidar: {angle_span_rad: 3.0, "
        "further_poses: [[-0.1, 0.0, 3.14]]}\n"
    )
    text = LOCAL % (SEEING % ("nav2_costmap_2d::ObstacleLayer", TWO_SCANS))
    setup = setup_of(COLUMN, text, base=str(robot))
    sources = setup.robot.navigation.local_costmap.plugin_blocks["obstacles"].observation_sources
    assert {name: source.scanner for name, source in sources.items()} == {"a": 1, "b": 2}


def test_a_lidar_that_does_not_see_all_around_only_stands_in_for_a_second_one(setup_of, tmp_path):
    robot = tmp_path / "half.yaml"
    robot.write_text("description: r\nrobot_radius: 0.2\nlidar: {angle_span_rad: 3.0}\n")
    text = LOCAL % (SEEING % ("nav2_costmap_2d::ObstacleLayer", TWO_SCANS))
    setup = setup_of(COLUMN, text, base=str(robot))
    assert row_of(setup, "obstacles.b.topic").status == Status.STAND_IN


def test_a_second_layer_of_a_type_is_a_layer_of_its_own(setup_of):
    scan = "observation_sources: s, s: {clearing: true, max_obstacle_height: 2.0}"
    voxels = "nav2_costmap_2d::VoxelLayer"
    text = (SEEING % (voxels, scan)).replace("[obstacles]", "[obstacles, more]")
    setup = setup_of(COLUMN, LOCAL % f"{text}, more: {{plugin: {voxels}, {scan}, z_voxels: 5}}")
    costmap = setup.robot.navigation.local_costmap
    assert costmap.plugins == ["obstacles", "more"]
    assert costmap.plugin_blocks["more"].z_voxels == 5
    assert setup.check.is_whole


@pytest.mark.parametrize(
    ("release_mark", "method", "plugins"),
    [
        ("costmap_update_timeout: 0.3", 3, ["obstacles"]),
        ("costmap_update_timeout: 0.3", 2, ["obstacles"]),
        ("progress_checker_plugin: p", 3, []),
        ("progress_checker_plugin: p", 2, []),
        ("progress_checker_plugin: p", 1, ["obstacles"]),
    ],
)
def test_a_way_to_combine_that_nav2_does_not_know(setup_of, release_mark, method, plugins):
    scan = (
        f"combination_method: {method}, observation_sources: s, "
        "s: {clearing: true, max_obstacle_height: 2.0}"
    )
    text = LOCAL % (SEEING % ("nav2_costmap_2d::ObstacleLayer", scan))
    mark = f"controller_server: {{ros__parameters: {{{release_mark}, p: {{plugin: 'x'}}}}}}"
    if "progress" in release_mark:
        mark = mark.replace("'x'", "nav2_controller::SimpleProgressChecker")
    setup = setup_of(COLUMN, text, mark)
    assert setup.robot.navigation.local_costmap.plugins == plugins
    if plugins:
        layer = setup.robot.navigation.local_costmap.plugin_blocks["obstacles"]
        assert layer.combination_method == (method if method <= 2 else 1)


def test_a_layer_that_sees_nothing_in_nav2_sees_nothing_here(setup_of):
    # Without max_obstacle_height a source of Nav2 takes points up to 0 m only.
    scan = "observation_sources: scan, scan: {data_type: LaserScan, clearing: true}"
    setup = setup_of(COLUMN, LOCAL % (SEEING % ("nav2_costmap_2d::ObstacleLayer", scan)))
    row = row_of(setup, "obstacles.scan.max_obstacle_height")
    assert row.status == Status.DOUBTFUL
    assert "this source sees nothing, as in Nav2" in row.remark


@pytest.mark.parametrize(
    ("layer", "bound", "heights"),
    [
        ("max_obstacle_height: -0.1", "max", "0 to -0.1 m"),
        ("min_obstacle_height: 0.3", "min", "0.3 to 2 m"),
    ],
)
def test_a_scan_beyond_the_heights_of_its_layer_sees_nothing(setup_of, layer, bound, heights):
    text = SEEING % ("nav2_costmap_2d::ObstacleLayer", f"{layer}, {SCAN}")
    row = row_of(setup_of(COLUMN, LOCAL % text), f"obstacles.s.{bound}_obstacle_height")
    assert row.status == Status.DOUBTFUL
    assert f"0.2 m, is outside of the obstacle heights of source and layer, {heights}" in row.remark


def test_a_spatio_temporal_layer_is_there_with_its_own_parameters(setup_of):
    stvl = "spatio_temporal_voxel_layer/SpatioTemporalVoxelLayer"
    source = "eye: {topic: /eye, clearing: true, horizontal_fov_angle: 1.2, max_z: 9.0}"
    layer = f"voxel_decay: 15.0, observation_sources: eye, {source}"
    setup = setup_of(COLUMN, LOCAL % (SEEING % (stvl, layer)))
    costmap = setup.robot.navigation.local_costmap
    assert costmap.plugins == ["obstacles"]
    assert costmap.plugin_blocks["obstacles"].voxel_decay == 15.0
    assert setup.robot.depth_sensors["eye"].horizontal_fov_rad == 1.2
    assert setup.robot.depth_sensors["eye"].range_max_m == 9.0
    assert setup.check.is_whole


VOXELS = "nav2_costmap_2d::VoxelLayer"
CLOUDS = "observation_sources: c, c: {data_type: PointCloud2, max_obstacle_height: 2.0}"
SCAN = "observation_sources: s, s: {clearing: true, max_obstacle_height: 2.0}"


@pytest.mark.parametrize("source", [SCAN, CLOUDS])
@pytest.mark.parametrize(
    ("given", "levels", "unknown"),
    [
        ("z_voxels: 16", 16, 15),
        # Four levels that the grid does not have count against the 15 unknown ones.
        ("z_voxels: 20", 16, 11),
        ("z_voxels: 20, unknown_threshold: 6", 16, 2),
        # Below 0 any number of unknown voxels is allowed.
        ("z_voxels: 20, unknown_threshold: 3", 16, 16),
        ("z_voxels: 40", 16, 16),
    ],
)
def test_a_voxel_layer_has_16_levels_at_most_as_in_nav2(setup_of, source, given, levels, unknown):
    setup = setup_of(COLUMN, LOCAL % (SEEING % (VOXELS, f"{given}, {source}")))
    voxels = setup.robot.navigation.local_costmap.plugin_blocks["obstacles"]
    assert (voxels.z_voxels, voxels.unknown_threshold) == (levels, unknown)
    row = row_of(setup, "obstacles.z_voxels")
    if given == "z_voxels: 16":
        assert row.status == Status.USED
    else:
        assert row.status == Status.OTHER_FORM
        assert "of which the grid has 16, as in Nav2" in row.remark


def of_static_layer(setup_of, *, layer: str, costmap: str = "", mark: str = ""):
    """Returns the rows that stand in for something of the global costmap's map."""
    setup = setup_of(
        COLUMN,
        f"global_costmap: {{global_costmap: {{ros__parameters: {{plugins: [walls], {costmap} "
        f"walls: {{plugin: 'nav2_costmap_2d::StaticLayer', {layer}}}}}}}}}\n"
        f"some_server: {{ros__parameters: {{{mark}}}}}\n",
    )
    rows = [row for row in setup.check.stand_ins if row.parameter.endswith("map_topic")]
    assert setup.robot.navigation.global_costmap.plugins == ["static_layer"]
    return [(row.parameter, row.remark) for row in rows]


@pytest.mark.parametrize("topic", ["map", "/map", "/robot_1/map"])
def test_the_map_that_the_scenario_knows_is_the_map_in_any_namespace(setup_of, topic):
    assert of_static_layer(setup_of, layer=f"map_topic: {topic}") == []


def test_another_map_is_told_to_have_a_stand_in(setup_of):
    remark = "/keepout_map: the map that the scenario knows is used instead"
    rows = of_static_layer(setup_of, layer="map_topic: /keepout_map")
    assert rows == [("walls.map_topic", remark)]
    off = of_static_layer(setup_of, layer="map_topic: /keepout_map, enabled: false")
    assert off == []


@pytest.mark.parametrize(
    ("mark", "is_read"),
    [("costmap_update_timeout: 0.3", True), ("error_code_name_prefixes: [a]", False)],
)
def test_up_to_jazzy_a_static_layer_without_a_topic_has_that_of_its_costmap(
    setup_of, mark, is_read
):
    rows = of_static_layer(setup_of, layer="", costmap="map_topic: /other,", mark=mark)
    assert [parameter for parameter, _ in rows] == (["map_topic"] if is_read else [])


@pytest.mark.parametrize(
    "plugin", ["nav2_costmap_2d::RangeSensorLayer", "social::ProxemicLayer", "nvblox::VoxelLayer"]
)
@pytest.mark.parametrize("listed_in", ["plugins", "filters"])
def test_a_layer_that_is_switched_off_needs_no_stand_in(setup_of, plugin, listed_in):
    text = f"rolling_window: true, plugins: [], {listed_in}: [idle], idle: {{plugin: {plugin}, %s}}"
    text = text.replace("plugins: [], plugins", "plugins")
    setup = setup_of(COLUMN, LOCAL % (text % "enabled: false, phi: 0.1"))
    assert row_of(setup, "idle").status == Status.NO_MEANING
    assert setup.robot.navigation.local_costmap.plugins == []
    assert not [row for row in setup.check.stand_ins if row.parameter == "idle"]
    setup = setup_of(COLUMN, LOCAL % (text % "enabled: true, phi: 0.1"))
    assert row_of(setup, "idle").status == Status.STAND_IN


def test_a_second_layer_of_a_type_that_is_switched_off_needs_no_stand_in(setup_of):
    walls = "{plugin: 'nav2_costmap_2d::StaticLayer', %s}"
    text = f"plugins: [a, b], a: {walls % ''}, b: {walls % 'enabled: %s'}"
    setup = setup_of(COLUMN, LOCAL % (text % "false"))
    assert row_of(setup, "b").status == Status.NO_MEANING
    setup = setup_of(COLUMN, LOCAL % (text % "true"))
    assert row_of(setup, "b").status == Status.STAND_IN


def test_an_obstacle_layer_stands_in_for_one_of_others_that_sees(setup_of):
    setup = setup_of(COLUMN, LOCAL % (SEEING % ("nvblox::nav2::NvbloxCostmapLayer", "a: 1")))
    assert setup.robot.navigation.local_costmap.plugins == ["obstacle_layer"]
    assert not setup.check.is_whole


def test_one_obstacle_layer_stands_in_for_two_of_others_that_see(setup_of):
    nvblox = "{plugin: 'nvblox::nav2::NvbloxCostmapLayer'}"
    inflation = "{plugin: 'nav2_costmap_2d::InflationLayer'}"
    layers = f"plugins: [walls, people, halo], walls: {nvblox}, people: {nvblox}, halo: {inflation}"
    setup = setup_of(COLUMN, LOCAL % f"rolling_window: true, {layers}")
    assert setup.robot.navigation.local_costmap.plugins == ["obstacle_layer", "inflation_layer"]
    remark = "NvbloxCostmapLayer: an obstacle layer with the robot's lidar is used instead"
    told = {row.parameter for row in setup.check.stand_ins if row.remark.endswith(remark)}
    assert told == {"walls", "people"}


def test_a_global_costmap_that_rolls_is_taken_with_its_size(setup_of):
    rolls = "global_costmap: {global_costmap: {ros__parameters: {rolling_window: true, width: 9}}}"
    setup = setup_of(COLUMN, rolls)
    costmap = setup.robot.navigation.global_costmap
    assert costmap.rolling_window
    assert (costmap.width, costmap.height, costmap.resolution) == (9, 5, 0.1)
    assert not any(row.node.startswith("global_costmap") for row in setup.check.stand_ins)


def test_nothing_stands_in_for_a_layer_of_range_sensors(setup_of):
    setup = setup_of(
        """
        local_costmap:
          local_costmap:
            ros__parameters:
              rolling_window: true
              plugins: [sonar, inflation_layer]
              sonar: {plugin: "nav2_costmap_2d::RangeSensorLayer", topics: [/sonar]}
              inflation_layer: {plugin: "nav2_costmap_2d::InflationLayer"}
        """
    )
    (row,) = setup.check.stand_ins
    assert row.remark.endswith(
        "as the robot has no range sensors; what they alone see stays unseen"
    )
    assert setup.robot.navigation.local_costmap.plugins == ["inflation_layer"]


SONARS = """
description: a robot with two sonars
like: wheelchair
range_sensors:
  sonar_left: {pose: [0.8, 0.2, 0.3]}
  right: {pose: [0.8, -0.2, -0.3]}
"""
SONAR_LAYER = (
    "rolling_window: true, plugins: [s], s: {plugin: 'nav2_costmap_2d::RangeSensorLayer', %s}"
)


@pytest.fixture
def with_sonars(tmp_path):
    """The path of a robot with the range sensors sonar_left and right."""
    path = tmp_path / "with_sonars.yaml"
    path.write_text(SONARS)
    return str(path)


def test_a_layer_of_range_sensors_is_taken_whole_where_the_robot_has_them(setup_of, with_sonars):
    layer = "topics: [/sonar/left, /ultrasonic/right], phi: 1, clear_on_max_reading: true"
    setup = setup_of(COLUMN, LOCAL % (SONAR_LAYER % layer), base=with_sonars)
    block = setup.robot.navigation.local_costmap.plugin_blocks["s"]
    assert block.topics == ("sonar_left", "right")
    assert (block.phi, block.clear_on_max_reading, block.mark_threshold) == (1.0, True, 0.8)
    assert not [row for row in setup.check.stand_ins if row.parameter.startswith("s")]
    assert setup.robot.range_sensors.keys() == {"sonar_left", "right"}


def test_a_range_topic_that_the_robot_does_not_send_is_told(setup_of, with_sonars):
    layer = "topics: [/sonar/left, /sonar/rear]"
    setup = setup_of(COLUMN, LOCAL % (SONAR_LAYER % layer), base=with_sonars)
    row = row_of(setup, "s.topics")
    assert row.status is Status.STAND_IN
    assert row.remark.startswith("/sonar/rear: the robot has no such range sensor")
    assert setup.robot.navigation.local_costmap.plugin_blocks["s"].topics == ("sonar_left",)


def test_beside_range_sensors_an_obstacle_layer_still_stands_in_for_one_of_others(
    setup_of, with_sonars
):
    text = SONAR_LAYER % "topics: [/sonar/left]"
    text = text.replace("[s]", "[s, seen]") + ", seen: {plugin: 'nvblox::NvbloxLayer'}"
    setup = setup_of(COLUMN, LOCAL % text, base=with_sonars)
    assert setup.robot.navigation.local_costmap.plugins == ["s", "obstacle_layer"]


MONITOR = """
collision_monitor:
  ros__parameters:
    polygons: [zone]
    zone: {type: circle, radius: 0.5, action_type: stop}
    observation_sources: %s
    left: {type: range, topic: /sonar/left, obstacles_angle: 0.1, source_timeout: 0.5}
    rear: {type: range, topic: /sonar/rear}
    scan: {type: scan}
"""


def sources_of(setup):
    """Returns type, sensor and timeout of what the collision monitor looks at, by name."""
    sources = setup.robot.navigation.collision_monitor.observation_sources
    return {name: (one.type, one.sensor, one.source_timeout) for name, one in sources.items()}


def test_the_collision_monitor_looks_at_the_robots_range_sensors(setup_of, with_sonars):
    setup = setup_of(COLUMN, MONITOR % "[left, scan]", base=with_sonars)
    expected = {"left": ("range", "sonar_left", 0.5), "scan": ("scan", "", None)}
    assert sources_of(setup) == expected
    left = setup.robot.navigation.collision_monitor.observation_sources["left"]
    assert left.obstacles_angle == 0.1
    setup = setup_of(COLUMN, MONITOR % "[left]", base=with_sonars)
    assert list(sources_of(setup)) == ["left"]


def test_the_lidar_is_looked_at_where_the_robot_has_no_such_range_sensor(setup_of, with_sonars):
    setup = setup_of(COLUMN, MONITOR % "[rear]", base=with_sonars)
    assert sources_of(setup) == {"scan": ("scan", "", None)}
    row = row_of(setup, "rear")
    assert row.status is Status.STAND_IN
    assert row.remark == ("range: the robot has no such sensor; the lidar is used instead")
    setup = setup_of(COLUMN, MONITOR % "[rear, left]", base=with_sonars)
    assert list(sources_of(setup)) == ["scan", "left"]


def test_up_to_iron_a_range_that_cannot_be_measured_does_not_stop_the_robot(setup_of, with_sonars):
    old = "controller_server: {ros__parameters: {progress_checker_plugin: progress_checker}}\n"
    setup = setup_of(COLUMN + MONITOR % "[left, scan]", old, base=with_sonars)
    # Only later releases have a timeout for a source of its own.
    assert sources_of(setup)["left"] == ("range", "sonar_left", None)
    assert setup.robot.navigation.collision_monitor.nav2_release < "jazzy"


def test_a_topic_of_a_lidar_is_that_of_the_robots_only_lidar_of_many_layers(setup_of, tmp_path):
    """The robot has a camera as well; a third sensor is not added."""
    robot = tmp_path / "seeing.yaml"
    robot.write_text(
        "description: r\nrobot_radius: 0.2\ndepth_sensors: {eye: {height_m: 0.9}, "
        "top: {height_m: 0.8, horizontal_fov_rad: 6.2831853}}\n"
    )
    source = "observation_sources: a, a: {data_type: PointCloud2, topic: /atlas/velodyne_points}"
    text = LOCAL % (SEEING % ("nav2_costmap_2d::VoxelLayer", source))
    setup = setup_of(COLUMN, text, base=str(robot))
    assert sorted(setup.robot.depth_sensors) == ["eye", "top"]
    remark = row_of(setup, "obstacles.a.topic").remark
    assert remark == "the robot's only lidar of many layers, top"
