"""A world of Gazebo becomes polygons with heights, people and a task."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
import yaml
from descriptions_scenes import ROOM, box, standing, world
from PIL import Image
from small_disk import SmallDisk, on_small_disk

from drake_navbench.commands import import_world
from drake_navbench.commands.command_line import EXIT_DONE, EXIT_WRONG_INPUT
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.descriptions.mesh_slices import cut_area
from drake_navbench.inputs.gazebo_world import (
    is_world,
    load_gazebo_world,
    occupancy_of,
    scenario_in_world,
)
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.inputs.world_on_map import share_that_stands, warn_of_other_world
from drake_navbench.trial.goal_sampling import sample_world_tasks

LIDAR_M, TOP_M = 0.2, 0.5


def load(folder, body, *, name="room.world", **options):
    path = folder / name
    path.write_text(world(body) if "<sdf" not in body else body)
    return load_gazebo_world(path, lidar_m=LIDAR_M, top_m=TOP_M, **options)


def regions(found, **wanted):
    """Returns the area of the obstacles that have some values."""
    chosen = [o for o in found.obstacles if all(o.get(k) == v for k, v in wanted.items())]
    return shapely.union_all([shapely.Polygon(o["vertices"]) for o in chosen])


def test_boxes_and_cylinders_stand_where_their_poses_say(tmp_path):
    cylinder = standing(
        "pillar", "<cylinder><radius>0.5</radius><length>2</length></cylinder>", "2 1 1 0 0 0"
    )
    found = load(tmp_path, box("crate", "2 1 1", "-1 0 0.5 0 0 1.5707963") + cylinder)
    both = regions(found, known_to_planner=True)
    crate, pillar = sorted(shapely.get_parts(both), key=lambda part: part.centroid.x)
    assert crate.bounds == pytest.approx((-1.5, -1.0, -0.5, 1.0), abs=1e-3)
    assert pillar.centroid.coords[0] == pytest.approx((2.0, 1.0), abs=1e-3)
    assert pillar.area == pytest.approx(math.pi * 0.25, rel=0.02)


def test_a_world_is_read_anew_when_it_has_changed(tmp_path):
    for size_m in (1.0, 2.0):
        found = load(tmp_path, box("crate", f"{size_m} 1 1", "0 0 0.5 0 0 0"))
        assert regions(found).area == pytest.approx(size_m)


def test_what_the_lidar_does_not_see_is_touched_all_the_same(tmp_path):
    """A step of 0.1 m below the lidar, a table top at 0.4 m above it, a lamp above the robot."""
    found = load(
        tmp_path,
        box("step", "1 1 0.1", "0 0 0.05 0 0 0")
        + box("table", "1 1 0.05", "3 0 0.425 0 0 0")
        + box("lamp", "1 1 0.1", "6 0 2 0 0 0")
        + box("carpet", "1 1 0.01", "9 0 0.005 0 0 0"),
    )
    scenario = scenario_in_world(found, (0.0, 2.0, 0.0), (6.0, 2.0, 0.0))
    seen = scenario.true_world.visible_from(LIDAR_M)
    assert not seen.obstacles
    touched = [shapely.Point(x, 0.0) for x in (0.0, 3.0, 6.0, 9.0)]
    assert [scenario.true_world.intersects(p) for p in touched] == [True, True, False, False]
    table = next(o for o in scenario.world.obstacles if o.bottom_m > 0.0)
    assert table.bottom_m == pytest.approx(0.4)
    assert scenario.true_world.visible_from(0.42).obstacles == (table,)
    assert not scenario.known_world.obstacles


def test_a_sphere_is_as_wide_as_at_the_heights_that_matter(tmp_path):
    """Of 0.5 m radius, centre at 0.5 m: 0.4 m wide at 0.2 m, the lidar's height; 0.5 m touches."""
    found = load(
        tmp_path, standing("ball", "<sphere><radius>0.5</radius></sphere>", "0 0 0.5 0 0 0")
    )
    seen = regions(found, known_to_planner=True)
    assert math.sqrt(seen.area / math.pi) == pytest.approx(0.4, rel=0.02)
    assert math.sqrt(regions(found).area / math.pi) == pytest.approx(0.5, rel=0.03)


def prism(corners, low, high):
    """Returns the triangles (T, 3, 3) of the sides of an upright prism."""
    pairs = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    triangles = []
    for (ax, ay), (bx, by) in pairs:
        a, b, c, d = (ax, ay, low), (bx, by, low), (bx, by, high), (ax, ay, high)
        triangles += [[a, b, c], [a, c, d]]
    return np.array(triangles, dtype=float)


SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])


def test_a_mesh_is_solid_between_its_surfaces_and_free_within_walls():
    """Outer walls of 4 m and inner ones 0.5 m inside: a ring of 16 - 9 = 7 m^2."""
    walls = np.vstack([prism(SQUARE, 0, 1), prism(0.5 + 0.75 * SQUARE, 0, 1)])
    assert cut_area(walls, 0.5).area == pytest.approx(7.0, abs=0.2)
    assert not cut_area(walls, 0.5).contains(shapely.Point(2.0, 2.0))
    assert cut_area(walls, 1.5).is_empty


def test_a_mesh_whose_surfaces_have_two_sides_is_solid_whichever_way_they_run():
    """A square of 16 m^2, and one of 2 m^2 that stands on a corner; each triangle twice."""
    diamond = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    for corners, area in ((SQUARE, 16.0), (diamond, 2.0)):
        outside = prism(corners, 0, 1)
        doubled = np.vstack([outside, outside[:, ::-1]])
        assert cut_area(doubled, 0.5).area == pytest.approx(area, abs=0.1)


def test_a_room_with_a_floor_and_no_ceiling_is_free_and_a_block_is_solid():
    """Walls of one sheet around 16 m^2, four of them 4 m long and 1 cm thick: 0.16 m^2."""
    walls = prism(SQUARE, 0, 1)
    level = np.array([[[0, 0, 0], [4, 0, 0], [4, 4, 0]], [[0, 0, 0], [4, 4, 0], [0, 4, 0]]], float)
    with_floor = np.vstack([walls, level])
    assert cut_area(with_floor, 0.5).area == pytest.approx(0.16, abs=0.01)
    block = np.vstack([with_floor, level + np.array([0.0, 0.0, 1.0])])
    assert cut_area(block, 0.5).area == pytest.approx(16.0, abs=0.2)


def test_a_mesh_without_volume_stops_a_beam_still():
    sheet = prism(SQUARE, 0, 1)[:2]
    assert cut_area(sheet, 0.5).bounds == pytest.approx((0.0, -0.005, 4.0, 0.005))


def write_stl(path, triangles):
    data = np.zeros(len(triangles), dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    data["c"] = triangles
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"".ljust(80) + len(triangles).to_bytes(4, "little") + data.tobytes())


def test_a_room_of_one_mesh_is_included_by_model_uri_with_scale_and_pose(tmp_path):
    """The ring of 4 m, scaled by 2 and moved by (10, 0), in a model of the repository."""
    (tmp_path / ".git").mkdir()
    folder = tmp_path / "models" / "hall"
    walls = np.vstack([prism(SQUARE, 0, 1), prism(0.5 + 0.75 * SQUARE, 0, 1)])
    write_stl(folder / "meshes" / "hall.stl", walls)
    mesh = "<mesh><uri>model://hall/meshes/hall.stl</uri><scale>2 2 1</scale></mesh>"
    (folder / "model.sdf").write_text(
        f'<sdf version="1.7">{standing("hall", mesh, "0 0 0 0 0 0")}</sdf>'
    )
    (folder / "model.config").write_text('<model><sdf version="1.7">model.sdf</sdf></model>')
    (tmp_path / "worlds").mkdir()
    include = "<include><uri>model://hall</uri><pose>10 0 0 0 0 0</pose></include>"
    found = load(tmp_path / "worlds", include)
    area = regions(found, known_to_planner=True)
    assert area.bounds == pytest.approx((10.0, 0.0, 18.0, 8.0), abs=0.02)
    assert area.area == pytest.approx(28.0, abs=0.5)
    assert not area.intersects(shapely.Point(14.1, 4.0))


def test_a_spike_thinner_than_the_rounding_costs_no_polygon(tmp_path):
    """A square with a spike of 5 mm that comes back to within 0.01 mm of where it left."""
    corners = ((0, 0), (2, 0), (2, 1), (2.0043, 1.0025), (2, 1.00001), (2, 2), (0, 2))
    points = "".join(f"<point>{x} {y}</point>" for x, y in corners)
    shape = f"<polyline>{points}<height>1</height></polyline>"
    found = load(tmp_path, standing("block", shape, "0 0 0 0 0 0"))
    assert regions(found).area == pytest.approx(4.0, abs=0.01)


def test_nested_models_and_saved_states_place_what_they_hold(tmp_path):
    nested = (
        '<model name="outer"><pose>1 0 0 0 0 1.5707963</pose>'
        + box("inner", "0.4 0.2 1", "2 0 0.5 0 0 0")
        + "</model>"
    )
    state = '<state world_name="w"><model name="crate"><pose>0 -3 0.5 0 0 0</pose></model></state>'
    found = load(tmp_path, nested + box("crate", "1 1 1", "5 5 0.5 0 0 0") + state)
    inner, crate = sorted(shapely.get_parts(regions(found)), key=lambda part: -part.centroid.y)
    assert inner.bounds == pytest.approx((0.9, 1.8, 1.1, 2.2), abs=1e-3)
    assert crate.centroid.coords[0] == pytest.approx((0.0, -3.0))


def test_a_floor_that_is_no_plane_is_driven_on(tmp_path):
    slab = box("slab", "20 20 0.1", "0 0 0.05 0 0 0")
    found = load(tmp_path, slab + box("crate", "1 1 0.6", "3 0 0.4 0 0 0"))
    assert found.floor_m == pytest.approx(0.1)
    assert regions(found).bounds == pytest.approx((2.5, -0.5, 3.5, 0.5))


def test_an_actor_becomes_a_person_who_walks_its_trajectory(tmp_path):
    waypoints = "".join(
        f"<waypoint><time>{t}</time><pose>{x} 1 1.2 0 0 0</pose></waypoint>"
        for t, x in ((0, 0), (5, 3), (10, 0))
    )
    actor = (
        '<actor name="anna"><script><loop>true</loop><trajectory id="0" type="walk">'
        f"{waypoints}</trajectory></script></actor>"
    )
    found = load(tmp_path, ROOM + actor)
    person = scenario_in_world(found, (-2.0, -2.0, 0.0), (2.0, -2.0, 0.0)).world.people.persons[0]
    assert (person.name, person.start, person.speed_mps) == ("anna", (0.0, 1.0), 0.6)
    assert person.goals == [(3.0, 1.0), (0.0, 1.0)]


@pytest.mark.parametrize(
    ("first", "last", "reason"),
    [(0.0, 0.5, "starts inside an obstacle, at"), (-1.5, 1.5, "walks through an obstacle, from")],
)
def test_an_actor_that_obstacles_do_not_hinder_is_left_out_and_told(tmp_path, first, last, reason):
    """One actor must not make a whole world unusable."""
    points = "".join(
        f"<waypoint><time>{t}</time><pose>{x} 0 1.2 0 0 0</pose></waypoint>"
        for t, x in ((0, first), (5, last))
    )
    actor = f'<actor name="ghost"><script><trajectory id="0">{points}</trajectory></script></actor>'
    with pytest.warns(InputWarning, match=f"left out the actor ghost, which {reason}"):
        found = load(tmp_path, box("crate", "1 1 1", "0 0 0.5 0 0 0") + actor)
    assert not found.persons
    assert len(found.obstacles) == 1


def test_an_actor_that_goes_farther_than_any_robot_is_left_out_and_told(tmp_path):
    points = "".join(
        f"<waypoint><time>{t}</time><pose>{x} 5 900 0 0 0</pose></waypoint>"
        for t, x in ((0, 0), (200, 20000))
    )
    actor = f'<actor name="jet"><script><trajectory id="0">{points}</trajectory></script></actor>'
    with pytest.warns(InputWarning, match="actor jet, which goes 20000 m from the world's origin"):
        assert not load(tmp_path, ROOM + actor).persons


def test_what_is_left_out_is_told(tmp_path):
    robot = (
        '<model name="burger"><link name="l"/>'
        '<plugin filename="libgazebo_ros_diff_drive.so" name="d"/></model>'
    )
    fuel = "<include><uri>https://fuel.gazebosim.org/1.0/O/models/Desk</uri></include>"
    height = standing("hill", "<heightmap><uri>h.png</uri></heightmap>", "0 0 0 0 0 0")
    gone = "<include><uri>model://gone</uri></include><include><uri>model://sun</uri></include>"
    gone += "<include><name>nameless</name></include>"
    with pytest.warns(InputWarning) as told:
        found = load(tmp_path, robot + fuel + height + gone + '<light name="a" type="point"/>')
    text = " ".join(str(one.message) for one in told)
    for words in (
        "left out the robot burger",
        "models/Desk: is on the net; expected its folder by --packages",
        "left out a heightmap",
        "left out model://gone: no such model",
        "left out an <include>: expected a <uri> in it",
    ):
        assert words in text
    assert "sun" not in text
    assert not found.obstacles


def test_a_downloaded_model_of_fuel_is_taken_from_packages(tmp_path):
    folder = tmp_path / "fuel" / "openrobotics" / "models" / "desk" / "3"
    folder.mkdir(parents=True)
    (folder / "model.config").write_text('<model><sdf version="1.7">model.sdf</sdf></model>')
    (folder / "model.sdf").write_text(
        f'<sdf version="1.7">{box("d", "1 1 1", "0 0 0.5 0 0 0")}</sdf>'
    )
    fuel = "<include><uri>https://fuel.gazebosim.org/1.0/O/models/Desk</uri></include>"
    found = load(tmp_path, fuel, folders=[tmp_path / "fuel"])
    assert regions(found).area == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<sdf><world", "is not XML"),
        ("<html/>", "expected <sdf> with a <world>, found <html>"),
        ('<!DOCTYPE s [<!ENTITY a "b">]><sdf/>', "declares XML entities"),
        ("<sdf><world>" + "<model>" * 300 + "</model>" * 300 + "</world></sdf>", "too deeply"),
        ("<% for %><sdf/>", "is a template"),
    ],
)
def test_a_world_that_cannot_be_read_is_one_line(tmp_path, text, reason):
    path = tmp_path / "room.world"
    path.write_text(text)
    with pytest.raises(InputError, match=reason) as caught:
        load_gazebo_world(path, lidar_m=LIDAR_M, top_m=TOP_M)
    assert "\n" not in str(caught.value)


def test_a_comment_with_dashes_in_it_is_left_out_as_gazebo_does(tmp_path):
    plan = "<!----><!-- +--+ --- the room -->"
    found = load(tmp_path, plan + box("b", "1 1 1", "2 0 0.5 0 0 0") + "<!--- desk --->")
    assert regions(found).area == pytest.approx(1.0)


def test_a_model_that_includes_itself_is_one_line(tmp_path):
    folder = tmp_path / "loop"
    folder.mkdir()
    (folder / "model.config").write_text('<model><sdf version="1.7">model.sdf</sdf></model>')
    include = "<include><uri>model://loop</uri></include>"
    (folder / "model.sdf").write_text(f'<sdf><model name="loop">{include}</model></sdf>')
    with pytest.raises(InputError, match="/loop: the model loop nests deeper than 16 models"):
        load(tmp_path, include)


def test_a_world_of_ten_kilometres_is_cut_off_around_the_task(tmp_path):
    with pytest.warns(InputWarning, match="cut off 100 m around the task"):
        found = load(tmp_path, box("fence", "10000 0.2 1", "0 2 0.5 0 0 0"))
    assert regions(found).bounds == pytest.approx((-100.0, 1.9, 100.0, 2.1))


def test_a_world_of_webots_is_told_in_one_line(tmp_path):
    path = tmp_path / "room.wbt"
    path.write_text("#VRML_SIM R2023b utf8")
    assert is_world(path)
    with pytest.raises(InputError, match="is a world of Webots; expected one of Gazebo"):
        load_gazebo_world(path, lidar_m=LIDAR_M, top_m=TOP_M)


def test_goals_are_drawn_within_the_walls(tmp_path):
    found = load(tmp_path, ROOM)
    grid = occupancy_of(found)
    assert grid.value_at(np.array([0.0, 0.0])) == 0
    assert grid.value_at(np.array([4.9, 0.0])) == -1
    tasks = sample_world_tasks(found, load_robot("turtlebot4"), 20, seed=3)
    places = np.array([pose[:2] for task in tasks for pose in (task.start, task.goal)])
    assert (np.abs(places) < [4.0, 3.0]).all()


@pytest.mark.usefixtures("real_pngs")
def test_import_world_writes_a_scenario_that_is_the_same_world(tmp_path, capsys):
    path = tmp_path / "room.world"
    path.write_text(world(ROOM))
    out = tmp_path / "mine.yaml"
    asked = [str(path), "--start", "-2", "0", "0", "--goal", "2", "0", "0", "--out", str(out)]
    assert import_world.main(asked) == EXIT_DONE
    scenario = load_scenario(str(out))
    assert len(scenario.true_world.obstacles) == 4
    assert yaml.safe_load(out.read_text())["goal"] == [2.0, 0.0, 0.0]
    assert out.with_suffix(".png").stat().st_size > 10_000
    assert import_world.main(asked) == EXIT_WRONG_INPUT
    assert "exists; expected a new file" in capsys.readouterr().err


@pytest.mark.usefixtures("real_pngs")
def test_import_world_leaves_nothing_in_the_way_where_the_disk_is_full(tmp_path):
    (tmp_path / "room.world").write_text(world(ROOM))

    def import_twice(disk: SmallDisk) -> None:
        asked = [str(tmp_path / "room.world"), "--start", "-2", "0", "0", "--goal", "2", "0", "0"]
        print(import_world.main([*asked, "--out", str(disk.path / "mine.yaml")]))
        disk.grow("5m")
        print(import_world.main([*asked, "--out", str(disk.path / "mine.yaml")]))

    told = on_small_disk(tmp_path, "8k", import_twice)
    assert (told.out[0], told.out[-1]) == ("2", "0")
    (fault,) = told.error
    assert fault.endswith("mine.png: cannot be written: No space left on device")


def test_a_world_beside_its_map_is_planned_on_the_map_and_met_as_it_is(tmp_path):
    """The map shows a wall ahead; the world has the wall, and a box that no map shows."""
    wall, crate = box("wall", "0.2 4 1", "4 0 0.5 0 0 0"), box("crate", "1 1 1", "1.5 2 0.5 0 0 0")
    found = load(tmp_path, wall + crate)
    cells = np.full((120, 160), 254, dtype=np.uint8)
    # Cells of 5 cm from (-2, -3): the wall stands at x = 3.9 to 4.1, y = -2 to 2.
    cells[20:100, 118:122] = 0
    Image.fromarray(cells).save(tmp_path / "room.png")
    file = tmp_path / "room.yaml"
    file.write_text(
        "image: room.png\nresolution: 0.05\norigin: [-2, -3, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    scenario = scenario_in_world(found, (0.0, 0.0, 0.0), (3.0, 0.0, 0.0), map_file=file)
    assert scenario.map is not None
    assert (len(scenario.true_world.walls), len(scenario.true_world.obstacles)) == (0, 2)
    assert len(scenario.known_world.obstacles) == 0
    assert share_that_stands(occupancy_of(found), scenario.map) == 1.0
    tasks = sample_world_tasks(found, load_robot("turtlebot4"), 3, seed=0, map_file=file)
    assert all(task.map is not None and not task.world.map_stands for task in tasks)
    # The world's floor ends at x = 5.1 m, that of the map in free cells at 6 m.
    assert all(-2.0 < x < 5.1 for task in tasks for x in (task.start[0], task.goal[0]))
    with pytest.warns(InputWarning, match=r"room\.yaml: 0% of its occupied cells .*this world"):
        warn_of_other_world(load(tmp_path, crate, name="other.world"), file)


@pytest.mark.parametrize("place", ["model", "included in a model", "state"])
def test_a_model_that_fell_out_of_the_world_is_left_out_and_told(tmp_path, place):
    """Gazebo saves worlds with models that fall without end."""
    far = "3 0 -7.57769e+08 0 0 0"
    model = tmp_path / "rack" / "model.sdf"
    model.parent.mkdir()
    rack = box("rack", "1 1 1", "3 0 0.5 0 0 0")
    model.write_text(f'<sdf version="1.7">{rack}</sdf>')
    (tmp_path / "rack" / "model.config").write_text("<model><name>rack</name></model>")
    included = f"<include><uri>model://rack</uri><name>rack</name><pose>{far}</pose></include>"
    text = {
        "model": box("rack", "1 1 1", far),
        "included in a model": f'<model name="outer">{included}</model>',
        "state": f'{rack}<state><model name="rack"><pose>{far}</pose></model></state>',
    }[place]
    path = tmp_path / "w.world"
    path.write_text(world(text + box("other", "1 1 1", "6 0 0.5 0 0 0")))
    found = load_gazebo_world(path, lidar_m=LIDAR_M, top_m=TOP_M)
    assert f"left out rack: its pose, {far}, is beyond 1e+06 m" in found.remarks
    assert len(found.obstacles) == 1
