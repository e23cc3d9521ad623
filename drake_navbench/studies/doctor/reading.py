"""The first look: which rules fire on a file, and what may cause a symptom."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from typing import NamedTuple

from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.alike import (
    BY_WORDS,
    LIKED,
    NOTHING_TOLD,
    YOU_NAMED,
    Alike,
    Told,
    causes_liked,
    complaints_alike,
)
from drake_navbench.studies.doctor.attempts import is_among, named_in, tried_in_vain
from drake_navbench.studies.doctor.causes import RELEASE, Cause, Direction
from drake_navbench.studies.doctor.complaints import ALSO, causes_by_words
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.families import family_factor
from drake_navbench.studies.doctor.far_values import far_values
from drake_navbench.studies.doctor.left_out import CRITIC
from drake_navbench.studies.doctor.partial_files import facts_of_values
from drake_navbench.studies.doctor.possible import is_there
from drake_navbench.studies.doctor.rules import (
    bands,
    checkers,
    costmap_pairs,
    costmaps,
    dwb,
    dwb_arrival,
    inflation,
    monitor,
    mppi,
    mppi_critics,
    outline,
    planners,
    pursuit,
    releases,
    rpp_turns,
    servers,
    shim,
    smoother,
    sources,
    startup,
)
from drake_navbench.studies.doctor.rules.rule import SURE, Finding, Rule
from drake_navbench.studies.doctor.suspects import suspects_of
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.value_factors import BEYOND, WITHIN, value_factor

MODULES = (mppi, mppi_critics, dwb, dwb_arrival, pursuit, rpp_turns, shim, bands)
MODULES_OF_SERVERS = (
    startup, sources, servers, smoother, checkers, monitor, outline, costmaps, inflation,
    costmap_pairs, planners, releases,
)  # fmt: skip
RULES: tuple[Rule, ...] = tuple(
    rule for module in (*MODULES, *MODULES_OF_SERVERS) for rule in module.RULES
)
# The factors of a rule that fires over a suspect alone: of its first cure, and of the others.
OF_A_RULE = 1.3
NEXT_CURE = 0.85
# The factor of a rule that fires on nav2_bringup's own values, too: nearly every file has them.
ON_BRINGUP = 0.5
# Lines of nav2_bringup's file that differ from the defaults and from its controllers' presets.
LINES_OF_BRINGUP = {
    "debug_trajectory_details": True,
    "local_costmap.z_resolution": 0.05,
    "local_costmap.z_voxels": 16,
    "visualize": True,
}
# The factor of a parameter that a user names, in words or as one of a few values.
NAMED = 3.0
# The weight of a named value that is no suspect of the symptom: towards the usual value if it is
# far from it, and in either direction if it is not.
NAMED_FAR, NAMED_NEAR = 0.6, 0.3
# The factor of a change that a user has tried without success.
TRIED = 0.3
# The factor of a parameter that a user reports as missing.
MISSING = 6.0
# The factor of lowering a limit of speed for a robot that is too slow.
AGAINST = 0.4
SPEEDS = ("vx_max", "max_linear_vel", "max_vel_x", "max_speed_xy", "v_linear_max", "max_velocity")


class Suspicion(NamedTuple):
    """A cause with its score. reasons: what speaks for it, the strongest first."""

    cause: Cause
    score: float
    reasons: tuple[str, ...]
    findings: tuple[Finding, ...] = ()


def findings_of(facts: Facts, symptom: Symptom | None = None) -> list[Finding]:
    """Returns the rules that fire; without a symptom only those that are faults by themselves.

    Then what the file proves comes first, and what is only far from the usual last.
    """
    fired = []
    for rule in RULES:
        is_wanted = rule.is_certain if symptom is None else symptom in rule.symptoms
        if symptom is None and facts.nodes and not facts.is_whole:
            # The rest is the robot's: a fault there is none of the file's.
            is_wanted = is_wanted and (bool(rule.advice) or _rests_on_given(facts, rule))
        if is_wanted and not _needs_left_out(facts, rule) and rule.fires(facts):
            fired.append(rule.finding(facts))
    if symptom is not None:
        return fired
    fired.sort(key=lambda finding: max(finding.rule.symptoms.values()) < SURE)
    return [*fired, *far_values(facts, fired)]


def _needs_left_out(facts: Facts, rule: Rule) -> bool:
    """Tells whether a rule is about the list of critics, of which some could not be read."""
    is_partial = any(CRITIC.search(line) for line in facts.left_out)
    return is_partial and any(cause.place == "controller.critics" for cause in rule.cures)


class Words(NamedTuple):
    """The parameters that a user names: all, and those changed without success."""

    named: frozenset[str]
    in_vain: frozenset[str]

    @classmethod
    def of(cls, text: str) -> Words:
        """Returns the names in a user's words."""
        return cls(named_in(text), tried_in_vain(text))

    def factor(self, cause: Cause) -> float:
        """Returns the factor of a cause: `TRIED` if its change was tried without success."""
        return TRIED if is_among(cause, self.in_vain) else 1.0


def suspicions_of(facts: Facts, symptom: Symptom, told: Told = NOTHING_TOLD) -> list[Suspicion]:
    """Returns the possible causes of a symptom, the likeliest first.

    A cure of the known complaint that the user named first comes before all others.
    """
    named = Words.of(told.words)
    evidence: dict[tuple[str, Direction], list[tuple[float, Cause, str, Finding | None]]] = {}

    def add(weight: float, cause: Cause, why: str, finding: Finding | None = None) -> None:
        weight *= named.factor(cause) * _fit(symptom, cause)
        weight *= family_factor(symptom, told.words, cause)
        if weight > 0.0:
            evidence.setdefault(cause.key, []).append((weight, cause, why, finding))

    for finding in findings_of(facts, symptom):
        weight = OF_A_RULE * finding.rule.symptoms[symptom]
        if finding.rule.name in _firing_on_bringup(facts.kinds, facts.release) and not (
            not facts.is_whole and _rests_on_given(facts, finding.rule)
        ):
            weight *= ON_BRINGUP
        for cause in finding.cures:
            if is_there(facts, cause):
                add(weight * _named_factor(facts, cause, named), cause, finding.seen, finding)
                weight *= NEXT_CURE
    for suspect in suspects_of(symptom, facts.kinds):
        if is_there(facts, suspect.cause):
            factor = value_factor(facts, suspect.cause) * _named_factor(facts, suspect.cause, named)
            add(suspect.weight * factor, suspect.cause, suspect.cause.why)
    for weight, cause in _named_causes(facts, named):
        if cause.key not in evidence:
            add(weight, cause, cause.why)
    found = {key: _merged(pieces) for key, pieces in evidence.items()}
    for alike, cause in causes_by_words(facts, symptom, told.words):
        if is_there(facts, cause):
            weight = BY_WORDS * alike * value_factor(facts, cause)
            found[cause.key] = _with_words(found.get(cause.key), cause, weight)
    most = max((suspicion.score for suspicion in found.values()), default=1.0)
    for share, cause in causes_liked(facts, told.liked):
        own = _with_words(found.get(cause.key), cause, LIKED * most * share)
        found[cause.key] = own._replace(reasons=(YOU_NAMED, *own.reasons))
    return sorted(found.values(), key=lambda s: (-s.score, s.cause.place))


def asked_about(
    facts: Facts, symptom: Symptom, told: Told, suspicions: Sequence[Suspicion]
) -> list[Alike]:
    """Returns the known complaints of which the user is asked which is most like the own."""
    scores = {suspicion.cause.key: suspicion.score for suspicion in suspicions}
    return complaints_alike(facts, symptom, told, scores)


def _with_words(known: Suspicion | None, cause: Cause, weight: float) -> Suspicion:
    """Returns a suspicion, or a new one, with the weight of a complaint like the user's words."""
    if known is None:
        return Suspicion(cause, weight, (cause.why,))
    to = cause if known.cause.to is None and cause.to is not None else known.cause
    more = () if cause.why == ALSO else (cause.why,)
    reasons = tuple(dict.fromkeys((*known.reasons, *more)))
    return known._replace(cause=to, score=known.score + weight, reasons=reasons)


def _is_elsewhere(cause: Cause) -> bool:
    """Tells whether no change of the file is the cure."""
    return cause.is_outside or cause.place == RELEASE


def _fit(symptom: Symptom, cause: Cause) -> float:
    """Returns the factor that weakens a cure which would make the complaint worse."""
    is_against = symptom is Symptom.TOO_SLOW and cause.direction is Direction.DOWN
    return AGAINST if is_against and cause.place.rpartition(".")[2] in SPEEDS else 1.0


def _named_causes(facts: Facts, told: Words) -> Iterator[tuple[float, Cause]]:
    """Yields both directions of each number that a user names, the likelier one heavier."""
    names = {place: Cause(place, Direction.UP) for place in sorted(facts.values)}
    places = [p for p, cause in names.items() if is_among(cause, told.named)]
    if facts.is_told:
        places += sorted(facts.given - {*places})
    for place in places:
        size = facts.told.get(place)
        value = facts[place]
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if size == "missing" or (size is None and not is_number):
            continue
        for direction in (Direction.UP, Direction.DOWN):
            factor = value_factor(facts, Cause(place, direction))
            weight = NAMED_FAR if factor >= BEYOND else NAMED_NEAR if factor >= WITHIN else 0.0
            yield weight, Cause(place, direction, None, "You named its value.")


@cache
def _firing_on_bringup(kinds: tuple[str, ...], release: Release) -> frozenset[str]:
    """Returns the names of the rules that fire on nav2_bringup's own values."""
    facts = facts_of_values(" ".join(reversed(kinds)), release, LINES_OF_BRINGUP)
    return frozenset(rule.name for rule in RULES if rule.fires(facts))


def _rests_on_given(facts: Facts, rule: Rule) -> bool:
    """Tells whether some value that a rule would change was given, or is the release's own."""
    return rule.cures[0].place == RELEASE or any(
        place in facts.given for cause in rule.cures for place in facts.matching(cause.place)
    )


def _merged(pieces: list[tuple[float, Cause, str, Finding | None]]) -> Suspicion:
    pieces = sorted(pieces, key=lambda piece: -piece[0])
    known = [cause for _, cause, _, _ in pieces if cause.to is not None]
    cause = known[0] if known else pieces[0][1]
    # A rule that fires tells with the file's values what a suspect tells of any file.
    seen = [why for _, _, why, finding in pieces if why and finding is not None]
    reasons = tuple(dict.fromkeys(seen or [why for _, _, why, _ in pieces if why]))
    findings = tuple(f for _, _, _, f in pieces if f is not None)
    return Suspicion(cause, pieces[0][0], reasons, findings)


def _named_factor(facts: Facts, cause: Cause, told: Words) -> float:
    """Returns the factor of a cause that a user names, in words or as one of a few values."""
    if _is_elsewhere(cause):
        return 1.0
    is_named = is_among(cause, told.named) or (
        facts.is_told and any(p in facts.given for p in facts.matching(cause.place))
    )
    if facts.told.get(cause.place) == "missing":
        return MISSING
    return NAMED if is_named else 1.0
