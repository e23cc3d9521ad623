"""Rules about the sources of a costmap's obstacle layers: what Nav2 makes of a missing line."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import COSTMAPS, Facts
from drake_navbench.studies.doctor.rules.rule import SURE, Rule, put, up
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

CODE = "nav2_costmap_2d: obstacle_layer.cpp"
SEEING = ("::ObstacleLayer", "::VoxelLayer")
TOPIC = re.compile(r"(?P<costmap>local_costmap|global_costmap)\.(?:\w+\.)*\w+\.topic")


class Source(NamedTuple):
    """A source in the list of a layer. block: 'local_costmap.obstacle_layer.scan'."""

    block: str
    given: dict[str, Any]

    def number(self, name: str) -> float:
        """Returns a limit; Nav2's default of heights is 0 m."""
        value = self.given.get(name, 0.0)
        return float(value) if isinstance(value, int | float) else 1.0


def _sources(f: Facts, costmap: str) -> Iterator[Source]:
    """Yields the sources to which the layers of a costmap in a whole file listen."""
    names = f.raw.get(f"{costmap}.plugins")
    for layer in names if f.is_whole and isinstance(names, list) else ():
        block = f"{costmap}.{layer}"
        plugin = str(f.raw.get(f"{block}.plugin", "")).replace("/", "::")
        if not plugin.endswith(SEEING) or f.raw.get(f"{block}.enabled") is False:
            continue
        listed = f.raw.get(f"{block}.observation_sources")
        for name in listed.split() if isinstance(listed, str) else ():
            start = f"{block}.{name}."
            own = {k.removeprefix(start): v for k, v in f.raw.items() if k.startswith(start)}
            yield Source(start[:-1], own)


def _misnamed(f: Facts, costmap: str) -> list[tuple[Source, str]]:
    """Returns the sources without a block, with a block of their layer that no list names."""
    listed = {source.block for source in _sources(f, costmap)}
    found = []
    for source in _sources(f, costmap):
        layer = source.block.rpartition(".")[0]
        blocks = {
            name.removesuffix(".topic")
            for name in f.raw
            if name.startswith(f"{layer}.") and name.endswith(".topic")
        }
        free = sorted(blocks - listed)
        if free and not source.given:
            found.append((source, free[0].rpartition(".")[2]))
    return found


def _known(f: Facts, costmap: str) -> list[Source]:
    """Returns the sources but those whose block has another name, and is not read."""
    misnamed = {source.block for source, _ in _misnamed(f, costmap)}
    return [source for source in _sources(f, costmap) if source.block not in misnamed]


def _told_misnamed(f: Facts, costmap: str) -> str:
    """Returns in words which source has no block, and which block no source."""
    source, block = _misnamed(f, costmap)[0]
    layer, _, name = source.block.rpartition(".")
    return (
        f"{layer}.observation_sources names {name}, but the block below it is called {block}: "
        f"nothing reads the block, and {name} has Nav2's defaults (topic {name}, no clearing, "
        "max_obstacle_height 0 m)"
    )


def _marking(f: Facts, costmap: str) -> list[Source]:
    return [source for source in _known(f, costmap) if source.given.get("marking") is not False]


def _below_all(f: Facts, costmap: str) -> list[Source]:
    """Returns the sources whose band of heights holds nothing above the floor."""
    return [
        source
        for source in _marking(f, costmap)
        if source.number("max_obstacle_height") <= max(source.number("min_obstacle_height"), 0.0)
    ]


def _all_blind(f: Facts, costmap: str) -> bool:
    """Tells whether no source of a costmap marks anything, although some are listed."""
    return bool(_known(f, costmap)) and not _marking(f, costmap)


def _never_clearing(f: Facts, costmap: str) -> list[Source]:
    """Returns the sources of a costmap if none of them clears."""
    found = _known(f, costmap)
    return [] if any(source.given.get("clearing") is True for source in found) else found


def _relative(f: Facts, costmap: str) -> dict[str, str]:
    """Returns topics that the release looks for below the costmap's name, by their parameter."""
    if f.is_whole:
        topics = {f"{s.block}.topic": s.given.get("topic", "") for s in _known(f, costmap)}
    else:
        topics = {
            name: value
            for name, value in f.raw.items()
            if (found := TOPIC.fullmatch(name)) and found["costmap"] == costmap
        }
    # Before Humble the layers' node is that of the server, and from Kilted on its name is left out.
    is_own = f.release < Release.KILTED and f.told.get("release") != "old"
    return {
        name: str(topic) or name.split(".")[-2]
        for name, topic in topics.items()
        if is_own and not str(topic).startswith(("/", "~", "<"))
    }


def _absolute(costmap: str) -> Callable[[Facts], str | None]:
    return lambda f: next((f"/{topic}" for topic in _relative(f, costmap).values()), None)


def _told_band(sources: list[Source]) -> str:
    """Returns in words why the band of heights of the first source holds no point."""
    first = sources[0]
    highest, lowest = first.number("max_obstacle_height"), first.number("min_obstacle_height")
    default = "" if "max_obstacle_height" in first.given else ", Nav2's default where none is given"
    what = "every point above the floor"
    if lowest > 0.0:
        what = f"every point, as min_obstacle_height is {lowest:g} m"
    return (
        f"max_obstacle_height of {_first([source.block for source in sources])} is {highest:g} m"
        f"{default}: the layer drops {what}"
    )


def _told_topic(costmap: str, topics: dict[str, str]) -> str:
    """Returns in words where Nav2 looks for the first topic without a slash."""
    topic = next(iter(topics.values()))
    return (
        f"{_first([*topics])} is {topic}, without a slash before it: up to Jazzy the costmap "
        f"listens to /{costmap}/{topic}, not to /{topic}, unless a launch file remaps it"
    )


def _adding_nothing(f: Facts, costmap: str) -> list[str]:
    """Returns the places of methods by which a layer adds nothing to a costmap.

    From Jazzy on, Nav2 takes the default method for an unknown one.
    """
    return [
        name
        for name, value in f.raw.items()
        if name.startswith(f"{costmap}.")
        and name.endswith(".combination_method")
        and f.release <= Release.IRON
        and value not in (0, 1)
    ]


def _first(names: list[str]) -> str:
    return f"{names[0]}{f' (and {len(names) - 1} more)' if len(names) > 1 else ''}"


def _rules(costmap: str) -> tuple[Rule, ...]:
    blind = {S.IGNORES_OBSTACLES: SURE, S.COLLISION: 1.3, S.NEAR_MISS: 0.9}
    return (
        Rule(
            f"never-updated-{costmap}",
            lambda f: f.raw.get(f"{costmap}.update_frequency") in (0, 0.0),
            lambda f: f"{costmap}.update_frequency is 0 Hz: Nav2 never updates this costmap",
            {S.IGNORES_OBSTACLES: SURE, S.PLANNER_FAILS: SURE, S.NO_START: SURE, S.COLLISION: 1.3},
            (put(f"{costmap}.update_frequency", 5.0),),
            "nav2_costmap_2d: costmap_2d_ros.cpp, mapUpdateLoop",
        ),
        Rule(
            f"source-without-a-block-{costmap}",
            lambda f: bool(_misnamed(f, costmap)),
            lambda f: _told_misnamed(f, costmap),
            blind | {S.GHOST_OBSTACLES: 1.0},
            (put(f"{costmap}.observation_sources"),),
            CODE,
            advice="give the block the name that observation_sources has, or the other way round",
        ),
        Rule(
            f"source-below-the-floor-{costmap}",
            lambda f: bool(_below_all(f, costmap)),
            lambda f: _told_band(_below_all(f, costmap)),
            # A scan that is given at 0 m is seen.
            {S.IGNORES_OBSTACLES: 1.6, S.COLLISION: 0.6, S.NEAR_MISS: 0.4},
            (up(f"{costmap}.max_obstacle_height", 2.0), put(f"{costmap}.observation_sources")),
            CODE,
            advice="write max_obstacle_height: 2.0 (m) into the block of this source",
        ),
        Rule(
            f"layer-adds-nothing-{costmap}",
            lambda f: bool(_adding_nothing(f, costmap)),
            lambda f: (
                f"{_first(names := _adding_nothing(f, costmap))} is {f.raw[names[0]]}: up to Iron "
                "Nav2 knows 0 and 1, and with another number the layer adds nothing to the costmap"
            ),
            blind,
            (put(f"{costmap}.combination_method", 1),),
            CODE,
        ),
        Rule(
            f"source-without-marking-{costmap}",
            lambda f: _all_blind(f, costmap),
            lambda f: (
                f"marking is off in every source of {costmap}: no sensor marks obstacles there"
            ),
            blind,
            (put(f"{costmap}.marking", True),),
            CODE,
        ),
        Rule(
            f"source-without-clearing-{costmap}",
            lambda f: bool(_never_clearing(f, costmap)),
            lambda f: (
                f"no source of {costmap} sets clearing to true, and Nav2's default is false: a "
                "marked obstacle stays until the whole costmap is cleared"
            ),
            {S.GHOST_OBSTACLES: SURE, S.PLANNER_FAILS: 1.0, S.NO_RECOVERY: 0.8, S.DOOR_STOP: 0.6},
            (put(f"{costmap}.clearing", True),),
            CODE,
        ),
        Rule(
            f"topic-below-the-costmap-{costmap}",
            lambda f: bool(_relative(f, costmap)),
            lambda f: _told_topic(costmap, _relative(f, costmap)),
            blind | {S.GHOST_OBSTACLES: 0.3},
            (put(f"{costmap}.topic", _absolute(costmap)),),
            f"{CODE}; docs.nav2.org, migration to kilted",
        ),
    )


RULES = tuple(rule for costmap in COSTMAPS for rule in _rules(costmap))
