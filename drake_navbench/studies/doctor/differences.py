"""Differences of a file from Nav2: candidates for the experiment where the knowledge has none.

The suspects are the frequent causes of a symptom. Any other value may be a cause, too, and one
trial shows if changing it does nothing. So every unusual value is tried, after the suspects. What
is abnormal in this file is set back before all: another change may only make up for it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from itertools import chain

from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.cures import OTHER
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.far_values import is_robots_own
from drake_navbench.studies.doctor.in_effect import is_in_effect
from drake_navbench.studies.doctor.reading import Suspicion
from drake_navbench.studies.doctor.usual import (
    FAR,
    Unusual,
    unusual_value,
    usual_switches,
    usual_values,
)

# Scores of the candidates; suspects have weights of 0 to 1. FAR_SCORE: a value far from the usual
# ones. OTHER_SCORE: any other unusual value. SWITCH_SCORE: a switch. FAR_OWN_SCORE, OWN_SCORE: a
# limit of the robot's motion, or a range, far from the usual ones or not. It depends on the robot,
# so no finding names it, but it is tried: far ones before other unusual values, the others in the
# end.
FAR_SCORE, SWITCH_SCORE, FAR_OWN_SCORE, OTHER_SCORE, OWN_SCORE = 0.6, 0.4, 0.4, 0.2, 0.05
OF_LIMITS = (
    "max_vel*", "*_vel", "*speed*", "v[xy]_max", "wz_max", "v_linear*", "v_angular*", "acc_lim*",
    "decel_lim*", "a[xyz]_max", "a[xyz]_min", "*_accel", "*_decel", "*_range",
)  # fmt: skip
# Switches that are not turned off, though Nav2 has them off: they keep the robot from a touch.
CHECKS = ("*collision*", "*footprint*", "*obstacle*", "*marking*")
# From these ratios to Nav2's values on a value is abnormal: any, and the robot's own limits of
# motion and ranges, since the speeds of robots differ by less. In a file with more abnormal values
# than `MOST_BACK` being abnormal tells nothing: of 111 public files with a known cure half have 13
# and more, and the cure is one of these in 26. Two values that contradict each other count as one:
# one of them is wrong.
ABNORMAL, OWN_ABNORMAL, MOST_BACK = 1.6, 5.0, 3
# The factor of moving a value of Nav2's to one with which it is at odds: the other is the likelier.
OF_USUAL = 0.5
SOURCE = "Nav2's code and nav2_bringup/params/nav2_params.yaml"
# Further limits of the speed ahead: places of numbers, and of lists whose first number it is.
LIMITS, LISTS = ("controller.max_speed_xy",), ("velocity_smoother.max_velocity",)


def with_differences(suspicions: Sequence[Suspicion], facts: Facts) -> list[Suspicion]:
    """Returns the suspicions with those that the file's differences from Nav2 add, by score."""
    known = {(p, s.cause.direction) for s in suspicions for p in facts.matching(s.cause.place)}
    found = [*chain.from_iterable(_contradictions(facts)), *_differences(facts)]
    more = {s.cause.key: s for s in reversed(found) if s.cause.key not in known}
    return sorted([*suspicions, *reversed(more.values())], key=lambda s: -s.score)


def ways_back(suspicions: Sequence[Suspicion], facts: Facts) -> list[Suspicion]:
    """Returns the suspicions that set an abnormal value back to Nav2's, the likeliest first.

    A suspect of the symptom adds its score to that of the abnormal value. The list is empty if more
    than `MOST_BACK` values of the file are abnormal. If fewer are, limits of motion and ranges far
    from Nav2's count, too, but not the speed that the file asks for.
    """
    alone = list(_abnormal(facts))
    back = {way.cause.key: way for way in alone}
    places = {way.cause.place for way in alone}
    count = len(back)
    for ways in _contradictions(facts):
        count += places.isdisjoint(way.cause.place for way in ways)
        back |= {way.cause.key: way for way in ways}
    if count > MOST_BACK:
        return []
    far = (d for d in _differences(facts) if d.score == FAR_OWN_SCORE)
    limits = [d for d in far if d.cause.place != facts.speed_place and d.cause.key not in back]
    back |= {limit.cause.key: limit for limit in limits[: MOST_BACK - count]}
    found: dict[tuple[str, Direction], Suspicion] = {}
    for suspicion in suspicions:
        cause = suspicion.cause
        for key in [(place, cause.direction) for place in facts.matching(cause.place)]:
            if key in back:
                own = back[key]
                reasons = tuple(dict.fromkeys((*own.reasons, *suspicion.reasons)))
                new = cause._replace(place=key[0], to=own.cause.to)
                score = own.score + (suspicion.score if suspicion != own else 0.0)
                found.setdefault(key, Suspicion(new, score, reasons, suspicion.findings))
    return sorted(found.values(), key=lambda s: -s.score)


def _abnormal(facts: Facts) -> Iterator[Suspicion]:
    """Yields the differences that are large."""
    for found in _differences(facts):
        place = found.cause.place
        other = unusual_value(facts, place, least=ABNORMAL)
        is_own = other is not None and is_robots_own(other)
        if isinstance(facts[place], bool) or (
            other is not None
            and (not is_own or abs(math.log(other.ratio)) >= math.log(OWN_ABNORMAL) - 1e-9)
        ):
            yield found


def _contradictions(facts: Facts) -> Iterator[tuple[Suspicion, ...]]:
    """Yields the ways out of each contradiction of a file, which is wrong for any robot."""
    yield from _speeds_that_differ(facts)
    yield from _costmaps_that_differ(facts)


def _speeds_that_differ(facts: Facts) -> Iterator[tuple[Suspicion, ...]]:
    """Yields the ways out if the controller asks for a speed far from what the file lets drive.

    Where a limit is too low, the speed that is asked for is lowered or the limit is raised, at most
    to what the robot's own file gives. If that gives the speed asked for, the limit is the likelier
    one to be wrong.
    """
    asked = facts.asked_mps
    limits = {place: facts.number(place) for place in LIMITS}
    limits |= {place: facts.axis(place, 0) or 0.0 for place in LISTS}
    limits = {place: limit for place, limit in limits.items() if limit > 0.0}
    if not limits or asked <= 0.0:
        return
    low = min(limits, key=lambda place: limits[place])
    least = limits[low]
    if asked > OTHER * least:
        can_mps = facts.base_mps or asked
        why = f"The file lets nothing drive faster than {least:g} m/s."
        cause = Cause(facts.speed_place, Direction.DOWN, least, why, SOURCE)
        can_drive = OF_USUAL if facts.base_mps >= asked else 1.0
        score = FAR_SCORE * can_drive * _moved(facts, facts.speed_place)
        lower = Suspicion(cause, score, (why,))
        if can_mps <= OTHER * least:
            yield (lower,)
            return
        why = f"The controller asks for {asked:g} m/s."
        most = min(asked, can_mps)
        to = most if low in LIMITS else [most, *facts[low][1:]]
        cause = Cause(low, Direction.UP, to, why, SOURCE)
        yield lower, Suspicion(cause, FAR_SCORE * _moved(facts, low), (why,))
    elif least > FAR * asked:
        why = f"All else in the file lets the robot drive {least:g} m/s."
        cause = Cause(facts.speed_place, Direction.UP, least, why, SOURCE)
        yield (Suspicion(cause, FAR_OWN_SCORE, (why,)),)


def _costmaps_that_differ(facts: Facts) -> Iterator[tuple[Suspicion, ...]]:
    """Yields both numbers that differ between the costmaps, each to be set to the other one.

    Both see the same robot and sensors. Where both numbers are Nav2's, as of update_frequency, they
    differ on purpose.
    """
    for local in sorted(facts.given - facts.unreadable):
        other = local.replace("local_costmap.", "global_costmap.")
        if other == local or other not in facts.given:
            continue
        own, twin = facts.number(local), facts.number(other)
        if own * twin <= 0.0 or abs(math.log(own / twin)) < math.log(ABNORMAL):
            continue
        places = [(local, twin), (other, own)]
        if not all(is_in_effect(facts, place) for place, _ in places):
            continue
        known = usual_values(facts.kinds)
        if all(known.get(p) and not unusual_value(facts, p, least=OTHER) for p, _ in places):
            continue
        ways = []
        for place, to in places:
            up = Direction.UP if to > facts.number(place) else Direction.DOWN
            why = f"The other costmap has {to:g}."
            score = OTHER_SCORE * _moved(facts, place)
            ways.append(Suspicion(Cause(place, up, to, why, SOURCE), score, (why,)))
        yield tuple(ways)


def _moved(facts: Facts, place: str) -> float:
    """Returns the factor of a way out that moves a place's value: less if that is Nav2's."""
    is_known = bool(usual_values(facts.kinds).get(place))
    return OF_USUAL if is_known and not unusual_value(facts, place, least=OTHER) else 1.0


def _differences(facts: Facts) -> Iterator[Suspicion]:
    for place in sorted(facts.given - facts.unreadable):
        if not is_in_effect(facts, place):
            continue
        value = facts[place]
        if isinstance(value, bool):
            usual = usual_switches(facts.kinds).get(place)
            is_check = value and any(fnmatchcase(place, pattern) for pattern in CHECKS)
            if usual and value not in usual and not is_check:
                why = f"Nav2 and nav2_bringup have {str(not value).lower()}."
                cause = Cause(place, Direction.SET, not value, why, SOURCE)
                yield Suspicion(cause, SWITCH_SCORE, (why,))
            continue
        other = unusual_value(facts, place, least=OTHER)
        if other is None or (is_robots_own(other) and not _is_limit(other)):
            continue
        is_far = abs(math.log(other.ratio)) >= math.log(FAR) - 1e-9
        why = f"Nav2 or nav2_bringup has {other.nearest:g}."
        cause = Cause(place, other.back, other.nearest, why, SOURCE)
        far, near = (FAR_OWN_SCORE, OWN_SCORE) if is_robots_own(other) else (FAR_SCORE, OTHER_SCORE)
        yield Suspicion(cause, far if is_far else near, (why,))


def _is_limit(other: Unusual) -> bool:
    """Tells whether a value limits a motion or a sensor's range and is not switched off."""
    name = other.place.rpartition(".")[2]
    return other.value != 0.0 and any(fnmatchcase(name, pattern) for pattern in OF_LIMITS)
