"""Files of places to which a robot is sent: waypoints, goals, poses, a route graph.

Users and their programs write such files in many forms; `goal_poses.py` has those of one place. A
file's places are those under a name such as `waypoints` or `goals`, else all of the file, in order.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from drake_navbench.errors import InputError
from drake_navbench.inputs.goal_graph import (
    EDGES,
    Place,
    edges_between,
    geojson_graph,
    neighbours_in,
    require_map_frame,
    rmf_graph,
)
from drake_navbench.inputs.goal_on_earth import DATUM, Datum, datum_in, on_plane
from drake_navbench.inputs.goal_poses import (
    ORIENTATIONS,
    POSES,
    POSITIONS,
    FoundPose,
    below,
    ends_in_quaternion,
    is_numbers,
    pose_of,
    pose_of_numbers,
)
from drake_navbench.inputs.goal_table import places_in_table
from drake_navbench.typed_files.file_kinds import MAP, PRESET, ROBOT, SCENARIO, SIGNS
from drake_navbench.typed_files.input_file import read_input_text
from drake_navbench.typed_files.typed_yaml import MAX_FILE_BYTES, read_text, yaml_fault
from drake_navbench.typed_files.yaml_loader import load_yaml

TABLES, JSONS = (".csv", ".tsv", ".txt"), (".json", ".geojson")
# Names of a file's places: those that leave no doubt come before others.
NAMES = (
    re.compile(r"(?:way_?points?|goals?|goal_?poses|poses|patrol_?points|nodes)(?:_list)?$"),
    re.compile(r"(?:locations|places|points|stations|targets|route|path|destinations|positions|"
               r"checkpoints|stops|landmarks|wps?)$"),
)  # fmt: skip
PARAMETERS = "ros__parameters"
FRAMES = re.compile(r"(?:^|_)frame(?:_?id)?$")
STARTS = ("start", "start_pose", "initial_pose", "init_pose", "initialpose")
OWN_NAMES = ("name", "id", "label", "location_name", "idx")
# A heading beyond this, rad, shows that the file's headings are in degrees.
MOST_RAD = 2.0 * math.pi + 0.1
# Names of files, and of folders of Open-RMF's graphs, that may hold goals, and the most bytes.
FILE_NAMES = re.compile(
    r"way_?points?|goals?|poses|locations|places|stations|patrol|route|nav_graph|mission|graph"
)
MOST_BYTES = 2**20
EXPECTED = (
    "expected mappings with x and y, or lists [x, y, yaw], under a name such as waypoints or goals"
)


class GoalFile(NamedTuple):
    """The places of a file.

    edges: of a route graph, pairs of indices of places (from, to); None where the robot drives from
    place to place in order. start: the pose that the file calls the start. told: remarks.
    datum: the origin of the map on the earth, if the file has it.
    """

    path: Path
    places: tuple[Place, ...]
    edges: tuple[tuple[int, int], ...] | None = None
    start: FoundPose | None = None
    told: tuple[str, ...] = ()
    datum: Datum | None = None

    @property
    def is_on_earth(self) -> bool:
        """Whether a place is one by latitude and longitude."""
        return any(place.pose.is_on_earth for place in self.places)

    def on_ground(self, datum: Datum | None = None) -> GoalFile:
        """Returns the file with all places in m of a map or world, whose datum is the file's own,
        else the one given; raises InputError where a place needs one and there is none.
        """
        datum = self.datum or datum
        places = tuple(
            place._replace(pose=on_plane(place.pose, datum, f"{self.path}: {place.name}"))
            for place in self.places
        )
        start = self.start and on_plane(self.start, datum, f"{self.path}: its start")
        return self._replace(places=places, start=start)


def read_goal_file(path: Path) -> GoalFile:
    """Returns the places of a file; raises InputError, one line, where it has none."""
    if path.suffix.lower() in TABLES:
        text = read_input_text(path, max_bytes=MAX_FILE_BYTES)
        found = GoalFile(path, tuple(places_in_table(text, path)))
    else:
        data = _loaded(path)
        found = _graph_in(data, path) or _list_in(data, path)
    if not found.places:
        raise InputError(f"{path}: has no places; {EXPECTED}")
    return _in_radians(found)


def could_be_goals(path: Path) -> bool:
    """Tells whether a file's name and size are those of a file of places."""
    suffix = path.suffix.lower()
    if suffix not in (*TABLES[:1], *JSONS, ".yaml", ".yml"):
        return False
    name = f"{path.parent.name}/" * (path.parent.name == "nav_graphs") + path.stem
    return FILE_NAMES.search(name.lower()) is not None and path.stat().st_size <= MOST_BYTES


def _loaded(path: Path) -> Any:
    if path.suffix.lower() in JSONS:
        text = read_input_text(path, max_bytes=MAX_FILE_BYTES)
        try:
            return json.loads(text)
        except json.JSONDecodeError as error:
            raise InputError(f"{path}, line {error.lineno}: is no JSON: {error.msg}") from error
        except (RecursionError, ValueError) as error:
            raise InputError(f"{path}: is no JSON: {type(error).__name__}") from error
    text = read_text(path)
    try:
        data = load_yaml(text)
    except yaml.YAMLError as error:
        raise yaml_fault(error, str(path), text) from error
    for kind in (MAP, SCENARIO, ROBOT, PRESET):
        if isinstance(data, Mapping) and SIGNS[kind] & data.keys():
            raise InputError(f"{path}: is {kind}; expected a file of goals")
    return data


def _graph_in(data: Any, path: Path) -> GoalFile | None:
    """Returns the graph of a GeoJSON or Open-RMF file; None for any other."""
    if not isinstance(data, Mapping):
        return None
    if isinstance(data.get("features"), list):
        graph = geojson_graph(data, str(path))
    elif isinstance(data.get("levels"), Mapping) and data["levels"]:
        graph = rmf_graph(data, str(path))
    else:
        return None
    datum = datum_in(data, f"{path}: ")
    return GoalFile(path, graph.places, graph.edges or None, datum=datum)


def _list_in(data: Any, path: Path) -> GoalFile:
    """Returns the places of a list or mapping of places, and the edges between them if it has any.

    Raises InputError for places in another frame than the map's.
    """
    top = _unwrapped(data, f"{path}: ")
    own = top if isinstance(top, Mapping) else {}
    for key, value in own.items():
        if FRAMES.search(str(key)):
            require_map_frame(value, str(path))
    start = next((_start(own[key], f"{path}: {key}") for key in STARTS if key in own), None)
    rest = {key: value for key, value in own.items() if key not in (*STARTS, DATUM)} if own else top
    places, told = _chosen(rest, path)
    places, listed = _in_named_order(own, places)
    told += [f"{path}: {line}" for line in listed]
    edges = next((own[name] for name in EDGES if isinstance(own.get(name), list)), None)
    where = f"{path}: {next((name for name in EDGES if name in own), 'edges')}"
    is_graph = edges is not None or any(place.neighbours for place in places)
    pairs = edges_between(places, edges, where) if is_graph else ()
    datum = datum_in(own, f"{path}: ")
    return GoalFile(path, tuple(places), pairs or None, start, tuple(told), datum)


def _unwrapped(data: Any, where: str) -> Any:
    """Returns the mapping or list within ros__parameters, a node's name and the like."""
    while isinstance(data, Mapping):
        inner = data.get(PARAMETERS)
        if inner is None and len(data) == 1:
            key, inner = next(iter(data.items()))
            if any(names.search(str(key).lower()) for names in NAMES):
                return data
        if not isinstance(inner, Mapping) or pose_of(inner, where) is not None:
            return data
        data = inner
    return data


def _start(value: Any, where: str) -> FoundPose | None:
    if is_numbers(value):
        return pose_of_numbers(value, where, has_quaternions=ends_in_quaternion(value))
    return pose_of(value, where)


def _chosen(top: Any, path: Path) -> tuple[list[Place], list[str]]:
    """Returns the places under the names that leave least doubt, else all, and remarks."""
    if isinstance(top, Mapping):
        for names in NAMES:
            scopes = {k: v for k, v in top.items() if _is_called(names, k, v)}
            places = [p for k, v in scopes.items() for p in _places_in(v, path, str(k))]
            if places:
                others = {k: v for k, v in top.items() if k not in scopes}
                left = len(list(_mappings(others, f"{path}: ", "")))
                told = _taken(len(places), len(places) + left, f"of {', '.join(map(str, scopes))}")
                return places, [f"{path}: {told}"] if left else []
    return _places_in(top, path, ""), []


def _is_called(names: re.Pattern[str], key: Any, value: Any) -> bool:
    """Tells whether a key is such a name, and not that of a node with its parameters."""
    is_node = isinstance(value, Mapping) and PARAMETERS in value
    return names.search(str(key).lower()) is not None and not is_node


def _places_in(value: Any, path: Path, name: str) -> list[Place]:
    """Returns the places in a value: mappings with x and y or, without any, lists of numbers."""
    where = f"{path}: {name}" if name else f"{path}: "
    if is_numbers(value):
        raise InputError(f"{where}: a list of {len(value)} numbers; expected a list for each place")
    return list(_mappings(value, where, "")) or _plain(value, where, "")


def _mappings(value: Any, where: str, label: str) -> Iterator[Place]:
    """Yields the mappings, and pairs of lists, that are poses, in order, with their names.

    where: the value's place in errors. label: its name so far.
    """
    if isinstance(value, Mapping):
        key_name, label = label, _own_name(value) or label
        header = value.get("header", value)
        if isinstance(header, Mapping):
            require_map_frame(header.get("frame_id", ""), where)
        inner = {k: v for k, v in value.items() if k not in ORIENTATIONS}
        several = [
            key
            for key, one in inner.items()
            if isinstance(one, Mapping) and pose_of(one, below(where, key)) is not None
        ]
        pose = pose_of(value, where) if len(several) < 2 else None
        if pose is not None:
            inside = next((_own_name(value[key]) for key in POSES if key in value), "")
            name = _own_name(value) or inside or label or where.rpartition(": ")[2]
            yield Place(name, pose, neighbours_in(value), key_name)
            return
        for key, one in inner.items():
            is_wrapper = str(key).lower() in (*POSES, *POSITIONS) and len(several) < 2
            is_wrapper |= key == PARAMETERS
            own = label if is_wrapper else f"{label}.{key}".lstrip(".")
            yield from _mappings(one, below(where, key), own)
    elif isinstance(value, list):
        for index, one in enumerate(value):
            pose = pose_of(one, where) if isinstance(one, list) else None
            here = f"{where}[{index}]"
            if pose is not None:
                yield Place(here.rpartition(": ")[2], pose)
            else:
                is_named = not label or _only_key(one)
                yield from _mappings(one, here, "" if is_named else f"{label}[{index}]")


def _own_name(value: Any) -> str:
    """Returns the name that a mapping gives itself; '' for none."""
    given = [value.get(key) for key in OWN_NAMES] if isinstance(value, Mapping) else []
    return next((str(one) for one in given if type(one) in (str, int) and one != ""), "")


def _only_key(value: Any) -> str:
    """Returns the only key of a mapping, which names its place; '' for any other value."""
    return str(next(iter(value))) if isinstance(value, Mapping) and len(value) == 1 else ""


def _plain(value: Any, where: str, label: str) -> list[Place]:
    """Returns the lists of numbers that are places: in a list, or several in a mapping, all alike.

    label: name of the mapping that holds the value.
    """
    if isinstance(value, Mapping):
        arrays = _from_arrays(value, where)
        if arrays:
            return arrays
        entries = [
            (below(where, key), f"{label}.{key}".lstrip("."), one) for key, one in value.items()
        ]
    elif isinstance(value, list):
        entries = [(f"{where}[{index}]", "", one) for index, one in enumerate(value)]
    else:
        return []
    lists = [one for *_, one in entries if is_numbers(one)]
    is_alike = len(lists) > 1 and len({len(one) for one in lists}) == 1
    has_quaternions = all(map(ends_in_quaternion, lists))
    found: list[Place] = []
    for here, name, one in entries:
        if not is_numbers(one):
            if isinstance(value, list):
                _require_finite(one, here)
            found += _plain(one, here, name or label)
        elif isinstance(value, list) or is_alike:
            pose = pose_of_numbers(one, here, has_quaternions=has_quaternions)
            found.append(Place(name or here.rpartition(": ")[2], pose))
    return found


def _require_finite(value: Any, where: str) -> None:
    """Raises InputError for a list with a number that is NaN or infinite."""
    numbers = [n for n in value if isinstance(n, float)] if isinstance(value, list) else []
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"{where}: got {value}; expected finite numbers, in m and rad")


def _from_arrays(value: Mapping[Any, Any], where: str) -> list[Place]:
    """Returns the places of two lists of numbers, such as xs and ys, points_x and points_y."""
    for key, xs in value.items():
        begin, x, end = str(key).rpartition("x")
        ys = value.get(f"{begin}y{end}") if x and end in ("", "s") else None
        yaws = value.get(f"{begin}yaw{end}", value.get(f"{begin}theta{end}"))
        if not isinstance(xs, list) or not isinstance(ys, list) or len(xs) != len(ys):
            continue
        columns = [xs, ys, yaws] if isinstance(yaws, list) and len(yaws) == len(xs) else [xs, ys]
        rows = [list(row) for row in zip(*columns, strict=True)]
        if rows and all(map(is_numbers, rows)):
            name = begin.rstrip("_") or "place"
            return [
                Place(f"{name}[{i}]", pose_of_numbers(row, where, has_quaternions=False))
                for i, row in enumerate(rows)
            ]
    return []


def _in_named_order(
    top: Mapping[Any, Any], places: Sequence[Place]
) -> tuple[list[Place], list[str]]:
    """Returns places in the order of a list of their names, and lines on what differs in it."""
    by_name = {name: place for place in places for name in (place.key, place.name)}
    for key, value in top.items():
        if isinstance(value, list) and len(value) > 1 and all(isinstance(v, str) for v in value):
            known = [by_name[name] for name in value if name in by_name]
            if 2 * len(known) >= len(value):
                left = len({*places} - {*known})
                told = [_taken(len(known), len(known) + left, f"that {key} lists")] if left else []
                unknown = [name for name in value if name not in by_name]
                if unknown:
                    told.append(f"{key} lists {', '.join(unknown)}; no place is called so")
                return known, told
    return [*places], []


def _in_radians(found: GoalFile) -> GoalFile:
    """Returns a file with its headings in rad, where some are more than a turn."""
    told = [*found.told]
    places, start = found.places, found.start
    yaws = [p.pose.yaw for p in places if p.pose.yaw is not None]
    poses = [*(place.pose for place in places), *([] if start is None else [start])]
    most = max((abs(pose.yaw or 0.0) for pose in poses if pose.is_unit_open), default=0.0)
    if most > MOST_RAD:
        told.append(f"{found.path}: headings of up to {most:g} are taken as degrees")
    unit = math.radians(1.0) if most > MOST_RAD else 1.0
    places = tuple(place._replace(pose=_in_unit(place.pose, unit)) for place in places)
    start = None if start is None else _in_unit(start, unit)
    if len(yaws) < len(places):
        which = "no place has" if not yaws else f"{len(yaws)} of {len(places)} places have"
        told.append(
            f"{found.path}: {which} a heading; without one the robot arrives facing the way from "
            "the place before"
        )
    return found._replace(places=places, start=start, told=tuple(told))


def _in_unit(pose: FoundPose, unit_rad: float) -> FoundPose:
    """Returns a pose with its heading in rad; unit_rad: that of a heading without a unit."""
    if pose.yaw is None or not pose.is_unit_open:
        return pose
    return pose._replace(yaw=pose.yaw * unit_rad, is_unit_open=False)


def _taken(count: int, total: int, which: str) -> str:
    return f"takes {count} of {total} places, those {which}"
