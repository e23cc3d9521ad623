"""From a cause to values in the file: the place of its parameter, and the steps to try."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from drake_navbench.nav2.controllers import SERVER
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.nav2.patch import Place
from drake_navbench.studies.doctor.causes import (
    COPIES,
    UNITS,
    Cause,
    Direction,
    with_short_outlines,
)
from drake_navbench.studies.doctor.facts import ALIASES, CONTROLLER, COSTMAPS, Facts
from drake_navbench.studies.doctor.file_places import OF_SOURCES, file_places
from drake_navbench.studies.doctor.in_effect import is_in_effect
from drake_navbench.studies.doctor.new_layer import (
    LAYER,
    missing_layer,
    with_obstacle_layer,
)
from drake_navbench.studies.doctor.suspects import ranges
from drake_navbench.studies.doctor.usual import unusual_value

# The steps from a value for which no usual range is known.
FACTORS = {Direction.UP: (1.6, 2.6), Direction.DOWN: (0.6, 0.35)}
# A smaller step, as a share of the value, hardly shows.
LEAST_STEP = 0.2
DIGITS = 3
# From this share on a value is too far from a whole number to be rounded.
FAR_FROM_WHOLE = 0.25
MILD, STRONG, NAV2S = 0, 1, 2
# A velocity smoother that lets nothing back gets these shares of its speed ahead.
FORWARD, BACKWARD, BACK = (
    "velocity_smoother.max_velocity",
    "velocity_smoother.min_velocity",
    (0.5, 1.0),
)
# From this ratio on, a value counts as different from Nav2's.
OTHER = 1.3
# The flags with which MPPI checks the outline.
LOOK_AT_OUTLINE = frozenset(
    f"{CONTROLLER}.{critic}.consider_footprint" for critic in ("CostCritic", "ObstaclesCritic")
)
# The inflation that is tried reaches this much beyond the outline, m.
CELL_M = 0.05
SIDES = {"width": "height", "height": "width"}
OUTLINES = {
    f"local_costmap.{name}": f"global_costmap.{name}" for name in ("footprint", "robot_radius")
}


class Trial(NamedTuple):
    """A change of the file that is tried for a cause.

    changes: value by place in the file. parts: the changes of which it consists, if it is several.
    """

    cause: Cause
    changes: Mapping[Place, Any]
    parts: tuple[Trial, ...] = ()

    @classmethod
    def of_parts(cls, parts: Sequence[Trial]) -> Trial:
        """Returns several changes as one; of a place that two change, the first has its value."""
        changes = {p: value for part in reversed(parts) for p, value in part.changes.items()}
        return parts[0] if len(parts) == 1 else cls(parts[0].cause, changes, (*parts,))

    @property
    def told(self) -> str:
        """The change in words: 'FollowPath.wz_std: 0.25'."""
        if self.parts:
            return "; ".join(part.told for part in self.parts)
        if self.is_new_plugin:
            return self.cause.told
        told = ", ".join(f"{place}: {_shown(value)}" for place, value in self.changes.items())
        return with_short_outlines(told)

    @property
    def is_new_plugin(self) -> bool:
        """Whether the change only adds a critic or a layer."""
        is_list = self.cause.place.endswith((".critics", ".plugins"))
        return is_list and isinstance(self.cause.to, str) and not self.parts


def trials_of(cause: Cause, facts: Facts, setup: Nav2Setup) -> list[Trial]:
    """Returns the changes to try for a cause, the mildest first; none where no value is known.

    They are a mild step, a strong step and, if the file's value is far from it in this direction,
    Nav2's own value, because both steps from a far value may fall short.
    """
    if cause.is_outside or cause.direction is Direction.ADD:
        return []
    if cause.to == LAYER:
        costmap = cause.place.partition(".")[0]
        own = cause._replace(to=missing_layer(costmap, facts))
        return [Trial(own, with_obstacle_layer(costmap, facts))]
    places = [
        (place, facts[place])
        for place in facts.matching(cause.place)
        if "*" in cause.place or place == cause.place
    ]
    found: list[Trial] = []
    for step in (MILD, STRONG, NAV2S):
        changes: dict[Place, Any] = {}
        for place, value in places:
            new = _value(cause, place, value, facts, step)
            if new is None or new == value:
                continue
            for changed in (place, _place_that_follows(cause, place, new, facts)):
                for where in file_places(changed, facts, setup) if changed else ():
                    changes[where] = new
        if changes and changes not in [trial.changes for trial in found]:
            found.append(Trial(cause, changes))
    if found and cause.place in LOOK_AT_OUTLINE and cause.to is True:
        wide = _inflation_for_the_outline(facts, setup)
        found += [Trial(cause, {**found[-1].changes, **wide})] if wide else []
    return found


def _place_that_follows(cause: Cause, place: str, new: Any, facts: Facts) -> str:
    """Returns the place that has to change as well, else ''.

    An outline that is changed in the local costmap is changed in the global one, too.
    """
    if place not in OUTLINES:
        return _side_that_follows(cause, place, new, facts)
    other = OUTLINES[place]
    if cause.direction is Direction.SET:
        return other if facts.has_node("global_costmap") else ""
    is_small = cause.direction is Direction.UP and 0.0 < facts.number(other) < new
    return other if is_small and is_in_effect(facts, other) else ""


def _side_that_follows(cause: Cause, place: str, new: Any, facts: Facts) -> str:
    """Returns the other side of a costmap's window if it has to change as well, else ''.

    The window reaches as far as its shorter side; a square one stays square.
    """
    costmap, _, side = place.rpartition(".")
    if costmap not in COSTMAPS or side not in SIDES or not _is_number(new):
        return ""
    other = f"{costmap}.{SIDES[side]}"
    is_short = cause.direction is Direction.UP and 0.0 < facts.number(other) < new
    return other if is_short or facts.number(other) == facts.number(place) else ""


def scaled(trial: Trial, facts: Facts, share: float) -> Trial | None:
    """Returns a change of one number made smaller or larger by a share; None if it has no number.

    The way is a factor: from 3.0 to 1.5 half of it leads to 2.12, half as much again to 1.06.
    """
    value = facts[trial.cause.place]
    new = next(iter(trial.changes.values()))
    is_one = not trial.parts and _is_number(value) and _is_number(new) and value * new > 0
    if not is_one or any(other != new for other in trial.changes.values()):
        return None
    step = _like(_rounded(value * (new / value) ** share), value)
    known = (value, new)
    if any(abs(step - number) < LEAST_STEP * min(abs(step), abs(number)) for number in known):
        return None
    return Trial(trial.cause, dict.fromkeys(trial.changes, step))


def told_with_step(cause: Cause, facts: Facts) -> str:
    """Returns a cause as an instruction, with a first step where no value of the cure is known.

    'raise FollowPath.wz_std, say from 0.1 to 0.25 rad/s'.
    """
    place = next(iter(facts.matching(cause.place)), cause.place)
    value = facts[place]
    if _is_number(cause.to) and isinstance(value, int) and cause.to == int(cause.to):
        # Nav2 refuses 20.0 for a parameter that is a whole number.
        cause = cause._replace(to=int(cause.to))
    told = _as_in_the_file(cause, facts)
    if _side_that_follows(cause, place, cause.to, facts):
        side = place.rpartition(".")[2]
        told = told.replace(f".{side} to ", f".{side} and {SIDES[side]} to ")
    if not cause.is_number or cause.to is not None or value is None:
        return told
    step = _value(cause, place, value, facts, MILD)
    if step is None or step == value:
        return told
    unit = UNITS.get(place.rpartition(".")[2], "")
    return f"{told}, say from {_shown(value)} to {_shown(step)} {unit}".rstrip()


def _as_in_the_file(cause: Cause, facts: Facts) -> str:
    """Returns a cause as an instruction, with the parameter's whole name where the file has one.

    'local_costmap.voxel_layer.scan.topic' stands for 'local_costmap.topic', unless several sources
    have a topic.
    """
    first, _, name = cause.place.partition(".")
    start, short = f"{first}.", cause.place
    if first == CONTROLLER:
        start, short = f"{SERVER}.{facts.plugin}.", name
    names = (name, *(older for older, newer in ALIASES.items() if newer == name))
    layers = facts.raw.get(f"{first}.plugins") if first in COSTMAPS else None
    starts = [f"{start}{layer}." for layer in layers] if isinstance(layers, list) else []
    found = [
        raw
        for raw in facts.raw
        if raw in [f"{start}{own}" for own in names]
        or (raw.startswith((*starts,)) and raw.endswith(f".{name}"))
    ]
    if not found and name in OF_SOURCES:
        # What is missing goes into the block of the source.
        topics = [raw for raw in facts.raw if raw.startswith((*starts,)) and raw.endswith(".topic")]
        found = [f"{topic.removesuffix('.topic')}.{name}" for topic in topics]
    if len(found) != 1:
        return cause.told
    whole = found[0].removeprefix(f"{SERVER}.") if first == CONTROLLER else found[0]
    return re.sub(rf"(?<![\w.]){re.escape(short)}(?![\w.])", whole, cause.told, count=1)


def _inflation_for_the_outline(facts: Facts, setup: Nav2Setup) -> dict[Place, Any]:
    """Returns the change by which the local costmap's inflation reaches as far as the outline.

    MPPI checks the outline only if the cell under the robot's centre costs as much as a cell at the
    outline's reach from an obstacle, and a cell beyond the inflation costs nothing.
    """
    place, reach_m = "local_costmap.inflation_radius", facts.circumscribed_radius_m
    if facts.number(place) >= reach_m:
        return {}
    return dict.fromkeys(file_places(place, facts, setup), round(reach_m + CELL_M, 2))


def _value(cause: Cause, place: str, value: Any, facts: Facts, step: int) -> Any:
    if step == NAV2S:
        return _nav2s(cause, place, value, facts)
    if cause.direction is Direction.SET:
        return None if step else _set_value(cause, value, facts)
    if isinstance(value, list | tuple) and value and all(_is_number(v) for v in value):
        if isinstance(cause.to, list) and step == MILD:
            return cause.to
        ahead = facts.axis(FORWARD, 0) or 0.0
        if cause.place == BACKWARD and not value[0]:
            return [_rounded(-ahead * BACK[step]), *value[1:]]
        new = [0.0 if cause.to == 0.0 else _axis(float(v), cause.direction, step) for v in value]
        return None if new == value or (step and cause.to == 0.0) else new
    if value is None and _is_number(cause.to):
        return None if step else cause.to
    if not _is_number(value):
        return None
    stepped = _stepped(cause, place, float(value), step)
    return None if stepped is None else _like(stepped, value)


def _axis(value: float, direction: Direction, step: int) -> float:
    """Returns a step of one axis: a negative value is raised nearer to zero."""
    is_up = (direction is Direction.UP) == (value >= 0.0)
    return _rounded(value * FACTORS[Direction.UP if is_up else Direction.DOWN][step])


def _nav2s(cause: Cause, place: str, value: Any, facts: Facts) -> Any:
    """Returns Nav2's or nav2_bringup's value where it lies in the direction of the cure."""
    other = unusual_value(facts, place, least=OTHER)
    is_back = other is not None and cause.is_number and other.back is cause.direction
    return _like(other.nearest, value) if other is not None and is_back else None


def _set_value(cause: Cause, value: Any, facts: Facts) -> Any:
    if cause.place in COPIES:
        return facts[COPIES[cause.place]]
    if cause.to is None or value == cause.to:
        return None
    if isinstance(value, list):
        return None if cause.to in value else [*value, cause.to]
    return cause.to


def _stepped(cause: Cause, place: str, value: float, step: int) -> float | None:
    """Returns a mild or a strong step in the direction of the cure."""
    is_up = cause.direction is Direction.UP
    low, high = ranges().get(place, (None, None))
    steps: list[float] = []
    if _is_number(cause.to) and (float(cause.to) > value) == is_up and cause.to != value:
        steps.append(float(cause.to))
    if low is not None and high is not None:
        near, far = (low, high) if is_up else (high, low)
        ahead = [v for v in (near, 0.5 * (low + high), far) if _is_step(value, v, is_up)]
        # The far end of the usual range is a step for what lies in its half.
        steps += ahead[:-1] or ahead
    steps += [value * factor for factor in FACTORS[cause.direction]]
    if value == 0.0:
        steps = [v for v in steps if v != 0.0] or [0.1 if is_up else -0.1]
    if value < 0.0 and cause.to is None:
        # For a negative value, such as a deceleration, raising means nearer to zero.
        steps = [_axis(value, cause.direction, number) for number in (MILD, STRONG)]
    steps = [v for v in dict.fromkeys(map(_rounded, steps)) if v != value]
    return steps[step] if step < len(steps) else None


def _is_step(value: float, new: float, is_up: bool) -> bool:
    """Tells whether a new value lies in the direction, and so far that a drive may show it."""
    change = new - value
    return (change > 0.0) == is_up and abs(change) >= LEAST_STEP * abs(value)


def _like(new: float, value: Any) -> Any:
    """Returns a whole number where the file has one, unless that is far from the new value.

    A file may have 5 for a parameter that is no whole number: 0.2 stays 0.2.
    """
    whole = max(round(new), 1)
    is_whole = isinstance(value, int) and not isinstance(value, bool)
    return whole if is_whole and abs(whole - new) <= FAR_FROM_WHOLE * new else new


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _shown(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
