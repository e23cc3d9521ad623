"""Route graphs: places with the edges between them.

Three forms: Nav2's GeoJSON (nav2_route: points with an `id`, lines with `startid` and `endid`),
Open-RMF's navigation graphs (vertices [x, y, {name}] and lanes [from, to, {}] of a level), and a
list of places beside `edges`, or with `neighbours` each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from drake_navbench.errors import InputError
from drake_navbench.inputs.goal_poses import FoundPose, checked, number_of

EDGES = ("edges", "lanes", "links", "connections")
NEIGHBOURS = ("neighbours", "neighbors", "connections", "connected_to", "adjacent", "edges")
ENDS = (("startid", "endid"), ("from", "to"), ("start", "end"), ("source", "target"), ("a", "b"))
TARGETS = ("node", "to", "target", "id", "name")
# The mark of GeoJSON coordinates in m; without any, the standard has longitudes and latitudes.
METRIC_MARK = "3857"
SHOWN = 60
# Frames that move against the map, or of another kind of coordinates.
OTHER_FRAMES = ("odom", "base_link", "base_footprint", "base", "wgs84", "utm", "gps", "camera_link")


class Place(NamedTuple):
    """A place of a file.

    name: its name or field there. neighbours: the places to which an edge leads. key: the key of
    its mapping, which may differ from its name.
    """

    name: str
    pose: FoundPose
    neighbours: tuple[str, ...] = ()
    key: str = ""


class Graph(NamedTuple):
    """Places and edges, pairs of indices (from, to)."""

    places: tuple[Place, ...]
    edges: tuple[tuple[int, int], ...]


def require_map_frame(frame: Any, where: str) -> None:
    """Raises InputError for a frame in which places are not those of a map."""
    if str(frame).strip("/").lower() in OTHER_FRAMES:
        raise InputError(f"{where}: frame {frame}; expected places in the map's frame, map")


def geojson_graph(data: Mapping[str, Any], source: str) -> Graph:
    """Returns the graph in a GeoJSON file; raises InputError."""
    features = [one if isinstance(one, Mapping) else {} for one in _list(data.get("features"))]
    properties = [_mapping(feature.get("properties")) for feature in features]
    is_metric = METRIC_MARK in str(data.get("crs", "")) or any(
        {"frame", "startid"} & own.keys() for own in properties
    )
    places: list[Place] = []
    ids: list[str] = []
    lines: list[tuple[str, tuple[str, str]]] = []
    for index, (feature, own) in enumerate(zip(features, properties, strict=True)):
        where = f"{source}: features[{index}]"
        shape = _mapping(feature.get("geometry"))
        if "startid" in own and "endid" in own:
            lines.append((where, (str(own["startid"]), str(own["endid"]))))
        elif shape.get("type") == "Point":
            pose = _point(shape, where, is_on_earth=not is_metric)
            require_map_frame(own.get("frame", ""), where)
            ids.append(str(own.get("id", index)))
            places.append(Place(_name_in(own, ids[-1]), pose))
    return Graph(tuple(places), _edges(lines, ids))


def rmf_graph(data: Mapping[str, Any], source: str) -> Graph:
    """Returns the graph of the only level of an Open-RMF navigation graph; raises InputError."""
    levels = data["levels"]
    if len(levels) != 1:
        raise InputError(f"{source}: levels: {', '.join(map(str, levels))}; expected one, as a map "
                         "shows one floor")  # fmt: skip
    name, level = next(iter(levels.items()))
    where = f"{source}: levels.{name}"
    if not isinstance(level, Mapping) or "measurements" in level or "drawing" in level:
        raise InputError(
            f"{where}: is a building of Open-RMF's traffic editor, in pixels; expected its "
            "navigation graph (nav_graphs/0.yaml)"
        )
    places = []
    for index, vertex in enumerate(_list(level.get("vertices"))):
        here = f"{where}.vertices[{index}]"
        x, y = (number_of(one) for one in (*_list(vertex)[:2], None, None)[:2])
        if x is None or y is None:
            raise InputError(f"{here}: got {vertex!r}; expected x, y and a mapping")
        own = vertex[-1] if isinstance(vertex[-1], Mapping) else {}
        places.append(Place(_name_in(own, str(index)), checked(FoundPose(x, y), here)))
    numbers = list(map(str, range(len(places))))
    lanes = [
        (f"{where}.lanes[{index}]", _ends(lane, f"{where}.lanes[{index}]"))
        for index, lane in enumerate(_list(level.get("lanes")))
    ]
    return Graph(tuple(places), _edges(lanes, numbers))


def edges_between(places: Sequence[Place], edges: Any, where: str) -> tuple[tuple[int, int], ...]:
    """Returns the edges of places by a file's list of edges, else by their neighbours.

    edges: pairs or mappings of two names or, where these are no names, of numbers from 0 on; None
    without such a list. Raises InputError for an end that is no place.
    """
    names = [place.name for place in places]
    pairs = [(f"{where}[{i}]", _ends(e, f"{where}[{i}]")) for i, e in enumerate(_list(edges))]
    if not pairs:
        pairs = [
            (f"{where}: {place.name}: neighbours", (place.name, other))
            for place in places
            for other in place.neighbours
        ]
    if not {end for _, ends in pairs for end in ends} & set(names):
        names = list(map(str, range(len(places))))
    return _edges(pairs, names)


def neighbours_in(value: Mapping[Any, Any]) -> tuple[str, ...]:
    """Returns the names of the places to which edges lead from a place's mapping."""
    for name in NEIGHBOURS:
        found = []
        for one in _list(value.get(name)):
            if isinstance(one, Mapping):
                one = next((one[key] for key in TARGETS if key in one), None)
            found += [str(one)] if isinstance(one, str | int) else []
        if found:
            return tuple(found)
    return ()


def _ends(edge: Any, where: str) -> tuple[str, str]:
    """Returns the names of the places that an edge joins; raises InputError."""
    found = _list(edge)[:2]
    if isinstance(edge, Mapping):
        found = next(([edge[end] for end in ends] for ends in ENDS if set(ends) <= {*edge}), [])
    if len(found) != 2 or any(type(end) not in (int, str) for end in found):
        raise InputError(f"{where}: got {str(edge)[:SHOWN]}; expected the names of two places")
    return str(found[0]), str(found[1])


def _edges(
    pairs: Sequence[tuple[str, tuple[str, str]]], names: Sequence[str]
) -> tuple[tuple[int, int], ...]:
    """Returns pairs of names as indices, without repetition; raises InputError for another name."""
    index = {name: number for number, name in reversed([*enumerate(names)])}
    for where, ends in pairs:
        for end in ends:
            if end not in index:
                raise InputError(f"{where}: leads to {end}; expected a place of the file")
    return tuple(dict.fromkeys((index[a], index[b]) for _, (a, b) in pairs))


def _point(shape: Mapping[str, Any], where: str, *, is_on_earth: bool) -> FoundPose:
    x, y = (number_of(one) for one in (*_list(shape.get("coordinates"))[:2], None, None)[:2])
    if x is None or y is None:
        raise InputError(f"{where}.geometry.coordinates: expected x and y, in m")
    return checked(FoundPose(x, y, is_on_earth=is_on_earth), where)


def _name_in(own: Mapping[Any, Any], otherwise: str) -> str:
    for mapping in (own, _mapping(own.get("metadata"))):
        if isinstance(mapping.get("name"), str) and mapping["name"]:
            return str(mapping["name"])
    return otherwise


def _mapping(value: Any) -> Mapping[Any, Any]:
    return value if isinstance(value, Mapping) else {}


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []
