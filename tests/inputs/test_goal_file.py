"""Files of places are read in the forms in which users write them, and refused in one line."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.goal_file import GoalFile, could_be_goals, read_goal_file
from drake_navbench.inputs.goal_on_earth import Datum

HALF = math.pi / 2.0
# The places A (1, 2), facing y, and B (3, 4), facing x, in every form that is read.
NAMED = {
    "waypoints.yaml": "waypoints: [{name: A, x: 1, y: 2, yaw: 1.5708}, {id: B, x: 3, y: 4, h: 0}]",
    "named.yaml": "frame: map\nstops: {A: {x: 1.0, y: 2, theta: 1.5708}, B: {x: 3, y: 4, th: 0}}",
    "degrees.yaml": "A: {x: 1, y: 2, yaw_deg: 90}\nB: {x: 3, y: 4, yaw_deg: 0}",
    "quoted.yaml": "places: [{id: A, x: '1', y: '2e0', yaw: 1.5708}, {id: B, x: 3, y: 4, yaw: 0}]",
    "capital.yaml": "stops: [{location_name: A, x: 1, y: 2, Y: 1.5708}, {id: B, x: 3, y: 4, Y: 0}]",
    "stamped.yaml": (
        "A: {header: {frame_id: map}, pose: {position: {x: 1, y: 2, z: 0},"
        " orientation: {x: 0, y: 0, z: 0.7071, w: 0.7071}}}\n"
        "B: {pose: {position: {x: 3, y: 4}, orientation: {z: 0, w: 2}}}"
    ),
    "panel.yaml": (
        "waypoints:\n  A: {pose: [1, 2, 0], orientation: [0.7071, 0.0, 0.0, 0.7071]}\n"
        "  B: {pose: [3, 4, 0], orientation: [1, 0, 0, 0]}"
    ),
    "parts.yaml": (
        "- A: {point: {x: 1, y: 2, z: 0}, quaternion: {x: 0, y: 0, z: 0.7071, w: 0.7071}}\n"
        "- waypoint: {name: B, position: [3, 4, 0], orientation_rpy: [0, 0, 0]}"
    ),
    "parameters.yaml": (
        "/**: {ros__parameters: {names: [A, B], B: {x: 3, y: 4, z: 0, w: 1},"
        " A: {x: 1, y: 2, z: 0.7071, w: 0.7071}}}"
    ),
    "order.yaml": (
        "order: [a, b]\nplaces: {b: {label: B, x: 3, y: 4, z_orient: 0, w_orient: 1},"
        " c: {x: 9, y: 9}, a: {label: A, x: 1, y: 2, rot_z: 0.7071, rot_w: 0.7071}}"
    ),
    "lists.json": '{"frame": "map", "A": [1, 2, 1.5708], "B": [3, 4, 0]}',
    "nested.yaml": "rooms: [{name: A, goal: {x: 1, y: 2, yaw: 1.5708}}, {id: B, goal: [3, 4, 0]}]",
    "others.yaml": (
        "waypoints: {A: {x: 1, y: 2, yaw: 1.5708}, B: {x: 3, y: 4, yaw: 0}}\n"
        "furniture: [{name: table, x: 9, y: 9}]"
    ),
    "names.csv": "name, pose.position.x, pose.position.y, yaw_deg\nA, 1, 2, 90\nB, 3, 4, 0\n",
    "units.csv": "id,X (meters),Y (meters),yaw (deg)\nA,1,2,90\nB,3,4,0\n",
    "plain.csv": "# recorded\nA;1;2;0;0;0;0.7071;0.7071\nB;3;4;0;0;0;0;1\n",
}
UNNAMED = {
    "lists.yaml": "waypoints: [[1, 2, 1.5708], [3, 4, 0]]",
    "heights.yaml": "goals:\n- [1, 2, 0.3, 1.5708]\n- [3, 4, 0.3, 0.0]",
    "turns.yaml": "goals:\n- [1, 2, 0.7071, 0.7071]\n- [3, 4, 0.0, 1.0]",
    "poses.yaml": "poses:\n- [[1, 2, 0], [0, 0, 0.7071, 0.7071]]\n- [[3, 4, 0], [0, 0, 0, 1]]",
    "arrays.yaml": "waypoints_x: [1, 3]\nwaypoints_y: [2, 4]\nwaypoints_yaw: [1.5708, 0]",
    "plural.yaml": "xs: [1, 3]\nys: [2, 4]\nyaws: [1.5708, 0]",
    "columns.csv": "# x_m, y_m, psi_rad\n1, 2, 1.5708\n3, 4, 0\n",
    "slashes.csv": "// x, y, yaw, on/off\n1, 2, 1.5708, on\n3, 4, 0, off\n",
    "blanks.txt": "1 2 1.5708\n3 4 0\n",
    "half_turns.csv": "x,y,h\n1,2,90\n3,4,0\n",
}


def read(folder: Path, name: str, text: str) -> GoalFile:
    path = folder / name
    path.write_text(text)
    return read_goal_file(path)


@pytest.mark.parametrize("name", [*NAMED, *UNNAMED])
def test_every_form_of_two_places_is_read(tmp_path, name):
    found = read(tmp_path, name, NAMED.get(name) or UNNAMED[name])
    a, b = (place.pose for place in found.places)
    assert (a.x, a.y, b.x, b.y) == (1.0, 2.0, 3.0, 4.0)
    assert a.yaw == pytest.approx(HALF, abs=1e-4)
    assert b.yaw == 0.0
    assert found.edges is None
    if name in NAMED:
        assert [place.name for place in found.places] == ["A", "B"]


def test_places_left_out_and_headings_in_degrees_are_told(tmp_path):
    told = read(tmp_path, "others.yaml", NAMED["others.yaml"]).told
    assert told == (f"{tmp_path}/others.yaml: takes 2 of 3 places, those of waypoints",)
    told = read(tmp_path, "order.yaml", NAMED["order.yaml"]).told
    assert told == (f"{tmp_path}/order.yaml: takes 2 of 3 places, those that order lists",)
    told = read(tmp_path, "half_turns.csv", UNNAMED["half_turns.csv"]).told
    assert told == (f"{tmp_path}/half_turns.csv: headings of up to 90 are taken as degrees",)


def test_the_start_alone_tells_that_headings_are_in_degrees(tmp_path):
    text = "initial_pose: {x: 0, y: 0, yaw: 90}\ngoals: [[1, 2], [3, 4]]"
    found = read(tmp_path, "start.yaml", text)
    assert found.start.standing == (0.0, 0.0, pytest.approx(HALF))
    assert found.told[0].endswith("start.yaml: headings of up to 90 are taken as degrees")


# Two places: one faces y, by a quaternion or in degrees by name, the other one 1 rad or 60 degrees.
MIXED = {
    "quaternion.yaml": (
        "- {x: 1, y: 2, orientation: {z: 0.70710678, w: 0.70710678}}\n- {x: 3, y: 4, yaw: 60}",
        math.radians(60.0),
    ),
    "seven.yaml": (
        "goals: [[1, 2, 0, 0, 0, 0.70710678, 0.70710678], [3, 4, 60]]",
        math.radians(60.0),
    ),
    "start.yaml": (
        "initial_pose: {x: 0, y: 0, yaw: 90}\n"
        "goals: [{x: 1, y: 2, yaw_deg: 90}, {x: 3, y: 4, yaw: 60}]",
        math.radians(60.0),
    ),
    "turns.yaml": ("- {x: 1, y: 2, yaw_deg: 450}\n- {x: 3, y: 4, yaw: 1}", 1.0),
}


@pytest.mark.parametrize("name", MIXED)
def test_only_headings_without_a_unit_are_turned_into_rad(tmp_path, name):
    text, yaw = MIXED[name]
    a, b = (place.pose for place in read(tmp_path, name, text).places)
    assert math.remainder(a.yaw, 2.0 * math.pi) == pytest.approx(HALF)
    assert b.yaw == pytest.approx(yaw)


def test_a_name_in_quotes_may_hold_the_separator(tmp_path):
    for name, head in (("named.csv", "name,x,y\n"), ("plain.csv", "")):
        a, b = read(tmp_path, name, f'{head}"Room A, left", 1,2\nB,3,4\n').places
        assert (a.name, a.pose[:2]) == ("Room A, left", (1.0, 2.0))
        assert (b.name, b.pose[:2]) == ("B", (3.0, 4.0))


def test_a_listed_name_that_no_place_has_is_told(tmp_path):
    text = "order: [A, B, kichen]\nplaces: {B: {x: 3, y: 4, h: 0}, A: {x: 1, y: 2, h: 0}}"
    found = read(tmp_path, "order.yaml", text)
    assert [place.name for place in found.places] == ["A", "B"]
    assert found.told == (f"{tmp_path}/order.yaml: order lists kichen; no place is called so",)


@pytest.mark.parametrize("name", ["plain.csv", "names.csv", "lists.json", "waypoints.yaml"])
def test_a_mark_of_utf_8_and_windows_lines_change_nothing(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"\xef\xbb\xbf" + NAMED[name].replace("\n", "\r\n").encode())
    marked = read_goal_file(path).places
    assert marked == read(tmp_path, name, NAMED[name]).places


# One second of arc is 1/3600 degree: on the equator 30.92 m to the east and 30.715 to the north.
SECOND = 1.0 / 3600.0
ON_EARTH = {
    "gps.yaml": f"waypoints: [{{latitude: 0, longitude: 0}}, {{latitude: {SECOND}, longitude: 0}}]",
    "gps.csv": f"lat_deg,lng_deg\n0,0\n{SECOND},0\n",
    "sea.geojson": (
        '{"features": [{"geometry": {"type": "Point", "coordinates": [0, 0]}},'
        f' {{"geometry": {{"type": "Point", "coordinates": [0, {SECOND}]}}}}]}}'
    ),
}


@pytest.mark.parametrize("name", ON_EARTH)
def test_latitudes_and_longitudes_are_metres_north_and_east_of_a_datum(tmp_path, name):
    found = read(tmp_path, name, ON_EARTH[name])
    a, b = (place.pose for place in found.on_ground(Datum(0.0, -SECOND)).places)
    assert (a.x, a.y) == (pytest.approx(30.92, abs=0.005), 0.0)
    assert (b.x, b.y) == (pytest.approx(30.92, abs=0.005), pytest.approx(30.715, abs=0.005))


def test_the_datum_in_the_file_itself_comes_first(tmp_path):
    text = "datum: [60.0, 10.0, 0]\ngoals: [{lat: 60.0, lon: 10.0, yaw: 1}, {lat: 60, lon: 10.1}]"
    a, b = (place.pose for place in read(tmp_path, "own.yaml", text).on_ground().places)
    assert a.standing == (0.0, 0.0, 1.0)
    # A tenth of a degree at 60 degrees: 6378137 m * 1.0025, by the ellipsoid, * cos 60 * pi / 1800.
    assert b.x == pytest.approx(5580.0, abs=1.0)


def test_without_a_datum_a_line_says_where_it_can_stand(tmp_path):
    found = read(tmp_path, "gps.yaml", ON_EARTH["gps.yaml"])
    with pytest.raises(InputError, match=r"gps.yaml: waypoints\[0\]: latitude and longitude; exp"):
        found.on_ground()


GRAPHS = {
    "route.geojson": """{"type": "FeatureCollection", "features": [
        {"properties": {"id": 7, "frame": "map", "metadata": {"name": "A"}},
         "geometry": {"type": "Point", "coordinates": [1.0, 2.0]}},
        {"properties": {"id": 9}, "geometry": {"type": "Point", "coordinates": [3.0, 4.0]}},
        {"properties": {"id": 10, "startid": 9, "endid": 7}, "geometry": {}}]}""",
    "nav_graph.yaml": (
        "levels: {L1: {vertices: [[1, 2, {name: A}], [3, 4, {}]], lanes: [[1, 0, {}], [1, 0, {}]]}}"
    ),
    "graph.json": """{"nodes": [{"id": "A", "x": 1, "y": 2}, {"id": "B", "x": 3, "y": 4}],
        "edges": [{"from": "B", "to": "A"}]}""",
    "neighbours.yaml": "waypoints: [A: {x: 1, y: 2}, B: {x: 3, y: 4, neighbours: [A]}]",
}


@pytest.mark.parametrize("name", GRAPHS)
def test_the_edges_of_a_graph_are_its_ways(tmp_path, name):
    found = read(tmp_path, name, GRAPHS[name])
    assert [place.pose[:2] for place in found.places] == [(1.0, 2.0), (3.0, 4.0)]
    assert found.places[0].name == "A"
    assert found.edges == ((1, 0),)


REFUSED = {
    "pole.csv": ("lat,lon\n125.0,21.5\n", "pole.csv, line 2: latitude 125, longitude 21.5"),
    "north.yaml": (
        "datum: [48.0, 11.0, 1.57]\nwaypoints: [{lat: 48, lon: 10.1}]",
        "north.yaml: datum: a heading of 1.57; expected 0, x to the east",
    ),
    "shanghai.yaml": (
        "datum: [121.47, 31.23]\nwaypoints: [{lat: 31.23, lon: 121.48}]",
        "shanghai.yaml: datum: latitude 121.47, longitude 31.23; expected -90 to 90",
    ),
    "tokyo.yaml": (
        "datum: here\nwaypoints: [{lat: 35.7, lon: 139.7}]",
        "tokyo.yaml: datum: expected [latitude, longitude], in degrees, got here",
    ),
    "text.yaml": (
        "waypoints: [{x: 1, y: 2}, {x: left, y: 2}]",
        "text.yaml: waypoints[1].x: got 'left'; expected a number, in m",
    ),
    "nan.yaml": ("goals: {A: {x: .nan, y: 2}}", "nan.yaml: goals.A.x: got nan; expected a number"),
    "nan.json": (
        '{"goals": [[1, NaN], [3, 4]]}',
        "nan.json: goals[0]: got [1, nan]; expected finite numbers",
    ),
    "compass.yaml": (
        "goals: [{x: 1, y: 2, yaw: north}]",
        "compass.yaml: goals[0].yaw: got 'north'; expected a number, in rad",
    ),
    "compass.csv": (
        "x,y,yaw_deg\n1,2,north\n",
        "compass.csv, line 2.yaw_deg: got 'north'; expected a number, in degrees",
    ),
    "half.yaml": (
        "goals: [{x: 1, y: 2, orientation: {z: half, w: 1}}]",
        "half.yaml: goals[0].orientation: got [0.0, 0.0, 'half', 1]; expected numbers",
    ),
    "far.yaml": ("goals: [[4e5, 5e6]]", "far.yaml: goals[0]: x 400000, y 5000000; expected m"),
    "flat.yaml": ("goals: [1, 2, 3, 4]", "flat.yaml: goals: a list of 4 numbers; expected a list"),
    "arm.yaml": ("A: [0, 0, 1, 0, 1, 0, 0]\nB: [0, 0, 1, 0, 1, 0, 0]", "arm.yaml: A: a quaternion"),
    "odom.yaml": (
        "goals_frame: odom\ngoals: [[1, 2]]",
        "odom.yaml: frame odom; expected places in",
    ),
    "map.yaml": (
        "image: a.pgm\norigin: [0, 0, 0]",
        "map.yaml: is a map file; expected a file",
    ),
    "none.yaml": ("goals: [{title: win}]", "none.yaml: has no places; expected mappings with x"),
    "empty.yaml": ("", "empty.yaml: has no places"),
    "keys.json": ('{"": [1], "x": {"w": 1}, "y": {"": []}}', "keys.json: x: got"),
    "cut.json": ('{"waypoints": [', "cut.json, line 1: is no JSON: "),
    "cut.yaml": ("waypoints: [", "cut.yaml, line 2: "),
    "five.csv": ("1,2,3,4,5\n", "five.csv, line 1: 5 numbers; expected x, y or x, y, yaw"),
    "word.csv": ("1,2\n3,four\n", "word.csv, line 2: got 'four'; expected a number"),
    "ragged.csv": ("x,y\n1,2\n3\n", "ragged.csv, line 3: 1 columns; expected 2"),
    "building.yaml": (
        "levels: {L1: {drawing: {}, vertices: []}}",
        "building.yaml: levels.L1: is a",
    ),
    "floors.yaml": ("levels: {L1: {}, L2: {}}", "floors.yaml: levels: L1, L2; expected one"),
    "lost.json": (
        '{"nodes": [{"id": 1, "x": 1, "y": 2}], "edges": [[1, 5]]}',
        "lost.json: edges[0]",
    ),
    "lane.yaml": (
        "levels: {L: {vertices: [[1, 2]], lanes: [[0]]}}",
        "lane.yaml: levels.L.lanes[0]",
    ),
    "odd.geojson": (
        '{"features": [{"properties": 5, "geometry": {"type": "Point", "coordinates": [1]}}]}',
        "odd.geojson: features[0].geometry.coordinates: expected x and y, in m",
    ),
    "line.geojson": (
        '{"features": [{"properties": {"startid": 1, "endid": 2}, "geometry": {}}]}',
        "line.geojson: features[0]: leads to 1; expected a place of the file",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_other_files_are_one_line_with_file_and_field(tmp_path, name):
    text, said = REFUSED[name]
    with pytest.raises(InputError) as refused:
        read(tmp_path, name, text)
    assert str(refused.value).startswith(f"{tmp_path}/{said}")
    assert "\n" not in str(refused.value)


def test_a_file_is_looked_for_by_its_name(tmp_path):
    names = ("my_waypoints.yaml", "poses.csv", "nav_graphs/0.yaml", "package.json", "map.yaml")
    for name in names:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert [could_be_goals(tmp_path / name) for name in names] == [True, True, True, False, False]
