"""Rules about values that the local and the global costmap should share."""

from __future__ import annotations

import math

from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.rule import Rule, down, up
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.usual import OF_BRINGUP, USUAL_RADIUS_M

S = Symptom

# From this ratio on, the two costmaps describe different robots or distances.
DIFFERENT = 2.5
# Of the radius and the steepness of inflation: by whether the local costmap inflates less.
INFLATES = {
    True: "the controller keeps closer to obstacles than the plan does",
    False: "the planner plans through cells that the controller avoids",
}
SIZES = "the planner and the controller plan for robots of different size"
SYMPTOMS = {
    "inflation_radius": {S.DOOR_STOP: 0.6, S.NEAR_MISS: 0.6, S.STOP_START_JERK: 0.3},
    "cost_scaling_factor": {S.NEAR_MISS: 0.6, S.DOOR_STOP: 0.6, S.WOBBLE_STRAIGHT: 0.3},
    "robot_radius": {S.PLANNER_FAILS: 0.8, S.DOOR_STOP: 0.7, S.COLLISION: 0.7},
}
OTHER = {"local_costmap": "global_costmap", "global_costmap": "local_costmap"}


def _is_odd(f: Facts, costmap: str, name: str, above: bool) -> bool:
    """Tells whether a costmap's value is above, or below, the other's and is the less usual one."""
    places = f"{costmap}.{name}", f"{OTHER[costmap]}.{name}"
    if not {*places} <= f.given:
        return False
    own, other = (f.number(place) for place in places)
    if min(own, other) <= 0.0 or max(own / other, other / own) < DIFFERENT - 1e-9:
        return False
    usual = OF_BRINGUP.get(places[0], (USUAL_RADIUS_M,))[0]
    is_odder = abs(math.log(own / usual)) >= abs(math.log(other / usual))
    return is_odder and (own > other) == above


def _between(f: Facts, costmap: str, name: str) -> float:
    """Returns the other costmap's value, or nav2_bringup's if that is nearer."""
    own, other = (f.number(f"{c}.{name}") for c in (costmap, OTHER[costmap]))
    choices = [other, *OF_BRINGUP.get(f"{costmap}.{name}", ())[:1]]
    same_way = [value for value in choices if (value > own) == (other > own) and value != own]
    return min(same_way, key=lambda value: abs(math.log(value / own)))


def _rule(costmap: str, name: str, above: bool) -> Rule:
    cure = down if above else up
    place, other = f"{costmap}.{name}", f"{OTHER[costmap]}.{name}"
    # A larger radius inflates more, a larger cost_scaling_factor less.
    is_more = above == (name == "inflation_radius")
    inflates_less = is_more == (costmap == "global_costmap")
    meaning = SIZES if name == "robot_radius" else INFLATES[inflates_less]
    return Rule(
        f"{costmap.partition('_')[0]}-{name.replace('_', '-')}-{'above' if above else 'below'}",
        lambda f: _is_odd(f, costmap, name, above),
        lambda f: f"{place} is {f[place]}, but {other} {f[other]}: {meaning}",
        SYMPTOMS[name],
        (cure(place, lambda f: _between(f, costmap, name)),),
        "nav2_costmap_2d: inflation_layer.cpp, costmap_2d_ros.cpp; nav2_bringup gives both the "
        "same value",
    )


RULES = tuple(
    _rule(costmap, name, above)
    for name in ("robot_radius", "inflation_radius", "cost_scaling_factor")
    for costmap in OTHER
    for above in (True, False)
)
