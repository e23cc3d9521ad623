"""Rules about the collision monitor."""

from __future__ import annotations

from typing import Any

from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.rule import Rule, down, put, up
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

MONITOR = "nav2_collision_monitor"


def _polygons(f: Facts) -> list[str]:
    start = "collision_monitor.polygons."
    places = (p for p in f.values if p.startswith(start) and p.endswith(".action_type"))
    return [p.removeprefix(start).partition(".")[0] for p in places]


def _of(f: Facts, polygon: str, name: str) -> Any:
    return f[f"collision_monitor.polygons.{polygon}.{name}"]


def _polygons_that(f: Facts, action: str) -> list[str]:
    return [
        p
        for p in _polygons(f)
        if _of(f, p, "action_type") == action and _of(f, p, "enabled") is not False
    ]


def _sources(f: Facts) -> list[str]:
    """Returns the sources to which the monitor of a whole file listens."""
    names = f.raw.get("collision_monitor.observation_sources")
    listed = [str(name) for name in names] if isinstance(names, list) and f.is_whole else []
    return [n for n in listed if f.raw.get(f"collision_monitor.{n}.enabled") is not False]


def _least(f: Facts, name: str, default: float) -> float:
    found = [_of(f, polygon, name) for polygon in _polygons(f)]
    numbers = [float(v) for v in found if isinstance(v, int | float)]
    return min(numbers, default=default)


RULES = (
    Rule(
        "monitor-waits-for-every-source",
        lambda f: (
            f.release >= Release.JAZZY
            and f.number("collision_monitor.source_timeout", 2.0) > 0.0
            and len(_sources(f)) > 1
        ),
        lambda f: (
            f"the collision monitor stops the robot while any of {', '.join(_sources(f))} "
            "sends nothing"
        ),
        {S.NO_START: 0.8, S.STOP_START_JERK: 0.4, S.NO_RECOVERY: 0.3},
        (
            put("collision_monitor.observation_sources"),
            up("collision_monitor.source_timeout"),
        ),
        f"{MONITOR}: collision_monitor_node.cpp, invalid source",
        is_certain=False,
    ),
    Rule(
        "monitor-stops-the-way-back",
        lambda f: bool(_polygons_that(f, "stop")),
        lambda f: (
            f"while something is in {', '.join(_polygons_that(f, 'stop'))}, the collision "
            "monitor stops every motion, also one that leads away from it"
        ),
        {
            S.NO_RECOVERY: 1.0,
            S.NO_START: 0.7,
            S.STALL_BEFORE_GOAL: 0.5,
            S.DOOR_STOP: 0.6,
            S.REVERSE_FAILURE: 0.6,
            S.STOP_START_JERK: 0.4,
        },
        (put("collision_monitor.*.action_type", "approach"),),
        f"{MONITOR}: polygon.cpp, action STOP",
        is_certain=False,
    ),
    Rule(
        "monitor-slows-hard",
        lambda f: bool(_polygons_that(f, "slowdown")) and _least(f, "slowdown_ratio", 1.0) < 0.35,
        lambda f: (
            "a zone of the collision monitor slows the robot down to "
            f"{_least(f, 'slowdown_ratio', 1.0):g} of the commanded speed"
        ),
        {S.TOO_SLOW: 0.6, S.STALL_BEFORE_GOAL: 0.5, S.STOP_START_JERK: 0.4},
        (up("collision_monitor.*.slowdown_ratio", 0.5), put("collision_monitor.*.points")),
        f"{MONITOR}: polygon.cpp, action SLOWDOWN",
        is_certain=False,
    ),
    Rule(
        "monitor-believes-single-points",
        lambda f: bool(_polygons(f)) and _least(f, "min_points", 4) < 3,
        lambda f: (
            f"min_points of the collision monitor is {_least(f, 'min_points', 4):g}: so few "
            "points of the scan, which may be noise, trigger it"
        ),
        {S.STOP_START_JERK: 0.9, S.NO_START: 0.4, S.DOOR_STOP: 0.4},
        (up("collision_monitor.*.min_points", 4),),
        f"{MONITOR}: polygon.cpp",
    ),
    Rule(
        "monitor-without-patience",
        lambda f: 0.0 < f.number("collision_monitor.source_timeout", 2.0) < 0.3,
        lambda f: (
            f"source_timeout is {f['collision_monitor.source_timeout']} s: the collision "
            "monitor stops the robot when a scan is later than this"
        ),
        {S.STOP_START_JERK: 0.9, S.NO_START: 0.7},
        (up("collision_monitor.source_timeout", 1.0),),
        f"{MONITOR}: source.cpp",
    ),
    Rule(
        "monitor-looks-far-ahead",
        lambda f: any(
            float(_of(f, p, "time_before_collision") or 0.0) > 2.5
            for p in _polygons_that(f, "approach")
        ),
        lambda f: (
            "time_before_collision of the collision monitor is above 2.5 s: it slows the "
            "robot down for obstacles that the robot will not reach"
        ),
        {S.TOO_SLOW: 0.8, S.DOOR_STOP: 0.7, S.STALL_BEFORE_GOAL: 0.6},
        (down("collision_monitor.*.time_before_collision", 1.2),),
        f"{MONITOR}: polygon.cpp, action APPROACH",
    ),
)
