"""The first look: which rules fire on a file, and what may cause a symptom."""

from __future__ import annotations

from typing import NamedTuple

from drake_navbench.studies.doctor.causes import RELEASE, Cause, Direction
from drake_navbench.studies.doctor.clues import factor_for, favours_of
from drake_navbench.studies.doctor.facts import CONTROLLER, Facts
from drake_navbench.studies.doctor.rules import (
    bands,
    checkers,
    costmaps,
    dwb,
    dwb_arrival,
    inflation,
    monitor,
    mppi,
    mppi_critics,
    planners,
    pursuit,
    releases,
    rpp_turns,
    servers,
    shim,
    smoother,
)
from drake_navbench.studies.doctor.rules.rule import Finding, Rule
from drake_navbench.studies.doctor.suspects import Suspect, ranges, suspects_of
from drake_navbench.studies.doctor.symptoms import Symptom

MODULES = (mppi, mppi_critics, dwb, dwb_arrival, pursuit, rpp_turns, shim, bands)
MODULES_OF_SERVERS = (servers, smoother, checkers, monitor, costmaps, inflation, planners, releases)
RULES: tuple[Rule, ...] = tuple(
    rule for module in (*MODULES, *MODULES_OF_SERVERS) for rule in module.RULES
)
# A rule that fires is worth so much more than a suspect alone; its second cure less than the first.
OF_A_RULE = 1.6
NEXT_CURE = 0.85
# Of a rule about values that nobody gave, where the file is not a whole one: they may be others.
OF_DEFAULTS = 0.5
# Of a suspect whose value lies beyond the usual range on the side of the fault, within, and on the
# other side; and of a parameter that the controller has not.
BEYOND, WITHIN, OPPOSITE, ABSENT = 1.7, 1.0, 0.35, 0.45
# A parameter that somebody changed away from its default on the side of the fault.
CHANGED = 1.25
# Of what a user names in a file that is not a whole one.
NAMED = 1.5
# What adds to the best evidence for a cause, of each further piece.
FURTHER = 0.25


class Suspicion(NamedTuple):
    """A cause with its score. reasons: what speaks for it, the strongest first."""

    cause: Cause
    score: float
    reasons: tuple[str, ...]
    findings: tuple[Finding, ...] = ()


def findings_of(facts: Facts, symptom: Symptom | None = None) -> list[Finding]:
    """Returns the rules that fire; without a symptom only those that are faults by themselves."""
    fired = []
    for rule in RULES:
        is_wanted = rule.is_certain if symptom is None else symptom in rule.symptoms
        if symptom is None and facts.nodes and not facts.is_whole:
            # The rest is the robot's: a fault there is none of the file's.
            is_wanted = is_wanted and (bool(rule.advice) or _rests_on_given(facts, rule))
        if is_wanted and rule.fires(facts):
            fired.append(rule.finding(facts))
    return fired


def suspicions_of(facts: Facts, symptom: Symptom, words: str = "") -> list[Suspicion]:
    """Returns the possible causes of a symptom, the likeliest first.

    words: of the user, about symptom and robot.
    """
    favours = favours_of(words)
    evidence: dict[tuple[str, Direction], list[tuple[float, Cause, str, Finding | None]]] = {}

    def add(weight: float, cause: Cause, why: str, finding: Finding | None = None) -> None:
        weight *= factor_for(cause, favours)
        if weight > 0.0:
            evidence.setdefault(cause.key, []).append((weight, cause, why, finding))

    for finding in findings_of(facts, symptom):
        weight = OF_A_RULE * finding.rule.symptoms[symptom]
        if not facts.is_whole and not _rests_on_given(facts, finding.rule):
            weight *= OF_DEFAULTS
        for cause in finding.cures:
            if _is_there(facts, cause):
                add(weight * _named_factor(facts, cause), cause, finding.seen, finding)
                weight *= NEXT_CURE
    for suspect in suspects_of(symptom, facts.kinds):
        if _is_there(facts, suspect.cause):
            add(suspect.weight * value_factor(facts, suspect), suspect.cause, suspect.cause.why)
    found = [_merged(pieces) for pieces in evidence.values()]
    return sorted(found, key=lambda s: (-s.score, s.cause.place))


def _rests_on_given(facts: Facts, rule: Rule) -> bool:
    """Tells whether some value that a rule would change was given."""
    return any(
        place in facts.given for cause in rule.cures for place in facts.matching(cause.place)
    )


def _merged(pieces: list[tuple[float, Cause, str, Finding | None]]) -> Suspicion:
    pieces = sorted(pieces, key=lambda piece: -piece[0])
    score = pieces[0][0] + FURTHER * sum(weight for weight, *_ in pieces[1:])
    known = [cause for _, cause, _, _ in pieces if cause.to is not None]
    cause = known[0] if known else pieces[0][1]
    reasons = tuple(dict.fromkeys(why for _, _, why, _ in pieces if why))
    findings = tuple(f for _, _, _, f in pieces if f is not None)
    return Suspicion(cause, score, reasons, findings)


def _is_there(facts: Facts, cause: Cause) -> bool:
    """Tells whether a cause may be one: its node is in the file, and it is not cured already."""
    first = cause.place.partition(".")[0]
    is_missing = facts.is_whole and not facts.has_node(first)
    if cause.direction is Direction.ADD:
        # What can be added is a node, or a plugin before the controller.
        return is_missing if first != CONTROLLER else not facts.is_kind("shim")
    if first in ("velocity_smoother", "collision_monitor", "amcl") and is_missing:
        return False
    if cause.place in facts.unreadable:
        return False
    is_in_block = first == CONTROLLER and cause.place.count(".") > 1
    if is_in_block and facts.is_whole and facts[cause.place] is None:
        # The block of a critic that is not listed.
        return False
    if "*" in cause.place and facts.is_whole and not facts.matching(cause.place):
        return False
    return not (cause.direction is Direction.SET and cause.to is not None and _has(facts, cause))


def _has(facts: Facts, cause: Cause) -> bool:
    """Tells whether everything that a cause names has the value of the cure already."""
    values = [facts[place] for place in facts.matching(cause.place)]
    if not values:
        return False
    return all(
        cause.to in value if isinstance(value, list | tuple) else value == cause.to
        for value in values
    )


def value_factor(facts: Facts, suspect: Suspect) -> float:
    """Returns the factor by which a parameter's value raises or lowers a suspect's weight."""
    cause = suspect.cause
    factor = _named_factor(facts, cause)
    if cause.is_outside or cause.direction in (Direction.ADD, Direction.SET):
        return factor
    told = facts.told.get(cause.place)
    if told is not None:
        is_suspicious = (told == "low") == (cause.direction is Direction.UP)
        return factor * (BEYOND if is_suspicious else OPPOSITE)
    values = [facts[place] for place in facts.matching(cause.place)]
    value = next((v for v in values if v is not None), None)
    if value is None:
        return factor * ABSENT
    if isinstance(value, bool) or not isinstance(value, int | float):
        return factor
    return factor * _side(facts, cause, float(value))


def _side(facts: Facts, cause: Cause, value: float) -> float:
    low, high = ranges().get(cause.place, (None, None))
    is_up = cause.direction is Direction.UP
    below = low is not None and value < low - 1e-9
    above = high is not None and value > high + 1e-9
    if below or above:
        return BEYOND if below == is_up else OPPOSITE
    default = facts.defaults.get(cause.place)
    if isinstance(default, int | float) and not isinstance(default, bool) and value != default:
        return CHANGED if (value < default) == is_up else 1.0 / CHANGED
    return WITHIN


def _named_factor(facts: Facts, cause: Cause) -> float:
    """Returns the weight of what a user names who shows a few parameters only."""
    if facts.is_whole or cause.place == RELEASE:
        return 1.0
    return NAMED if any(place in facts.given for place in facts.matching(cause.place)) else 1.0
