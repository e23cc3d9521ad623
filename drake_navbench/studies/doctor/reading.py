"""The first look: which rules fire on a file, and what may cause a symptom."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from drake_navbench.studies.doctor.alike import (
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
from drake_navbench.studies.doctor.complaints import ALSO, causes_by_words, terms_of
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.far_values import far_values
from drake_navbench.studies.doctor.left_out import CRITIC
from drake_navbench.studies.doctor.possible import is_there
from drake_navbench.studies.doctor.ranking import Evidence, likeness_to_texts
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
from drake_navbench.studies.doctor.value_factors import WITHIN, value_factor

MODULES = (mppi, mppi_critics, dwb, dwb_arrival, pursuit, rpp_turns, shim, bands)
MODULES_OF_SERVERS = (
    startup, sources, servers, smoother, checkers, monitor, outline, costmaps, inflation,
    costmap_pairs, planners, releases,
)  # fmt: skip
RULES: tuple[Rule, ...] = tuple(
    rule for module in (*MODULES, *MODULES_OF_SERVERS) for rule in module.RULES
)
# The weight, as that of a suspect, of a value that a user names and that is no suspect.
NAMED = 0.1
# A parameter that a user reports as missing counts as if it were named so many times.
MISSING = 2.0
# The factor of a change that a user has tried without success.
TRIED = 0.3
# The factor of lowering a limit of speed for a robot that is too slow.
AGAINST = 0.4
SPEEDS = ("vx_max", "max_linear_vel", "max_vel_x", "max_speed_xy", "v_linear_max", "max_velocity")


class Suspicion(NamedTuple):
    """A cause with its score. reasons: what speaks for it, the strongest first.

    evidence: as of `ranking`, by which the score was made; none if it was not made there.
    """

    cause: Cause
    score: float
    reasons: tuple[str, ...]
    findings: tuple[Finding, ...] = ()
    evidence: Evidence = Evidence()


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


def suspicions_of(facts: Facts, symptom: Symptom, told: Told = NOTHING_TOLD) -> list[Suspicion]:
    """Returns the possible causes of a symptom, the likeliest first.

    A cure of the known complaint that the user named first comes before all others.
    """
    named = Words.of(told.words)
    pieces: dict[tuple[str, Direction], list[Suspicion]] = {}
    for piece in _pieces(facts, symptom):
        pieces.setdefault(piece.cause.key, []).append(piece)
    for piece in _named_values(facts, named):
        pieces.setdefault(piece.cause.key, [piece])
    for alike, cause in causes_by_words(facts, symptom, told.words):
        if is_there(facts, cause):
            known = pieces.setdefault(cause.key, [])
            reasons = () if known and cause.why == ALSO else (cause.why,)
            known.append(Suspicion(cause, 0.0, reasons, evidence=Evidence(words=alike)))
    found = {key: _merged(own) for key, own in pieces.items()}
    terms = terms_of(told.words)
    for key, own in found.items():
        cause, words = own.cause, own.evidence.words + likeness_to_texts(terms, own.cause)
        evidence = own.evidence._replace(named=_times_named(facts, cause, named), words=words)
        score = evidence.score * _factor(symptom, cause, named)
        found[key] = own._replace(score=score, evidence=evidence)
    most = max((suspicion.score for suspicion in found.values()), default=1.0)
    for share, cause in causes_liked(facts, told.liked):
        own = found.get(cause.key, Suspicion(cause, 0.0, (cause.why,)))
        found[cause.key] = _liked(own, cause, LIKED * most * share)
    return sorted(found.values(), key=lambda s: (-s.score, s.cause.place))


def _pieces(facts: Facts, symptom: Symptom) -> Iterator[Suspicion]:
    """Yields the evidence of rules and suspects, a piece for each cause of each."""
    for finding in findings_of(facts, symptom):
        evidence = Evidence(rule=finding.rule.symptoms[symptom])
        for cause in finding.cures:
            if is_there(facts, cause):
                yield Suspicion(cause, 0.0, (finding.seen,), (finding,), evidence)
    for suspect in suspects_of(symptom, facts.kinds):
        if is_there(facts, suspect.cause):
            evidence = Evidence(suspect=suspect.weight * value_factor(facts, suspect.cause))
            yield Suspicion(suspect.cause, 0.0, (suspect.cause.why,), evidence=evidence)


def asked_about(
    facts: Facts, symptom: Symptom, told: Told, suspicions: Sequence[Suspicion]
) -> list[Alike]:
    """Returns the known complaints of which the user is asked which is most like the own."""
    scores = {suspicion.cause.key: suspicion.score for suspicion in suspicions}
    return complaints_alike(facts, symptom, told, scores)


def _liked(known: Suspicion, cause: Cause, weight: float) -> Suspicion:
    """Returns a suspicion with the weight of a complaint that the user named."""
    to = cause if known.cause.to is None and cause.to is not None else known.cause
    more = () if cause.why == ALSO else (cause.why,)
    reasons = tuple(dict.fromkeys((YOU_NAMED, *known.reasons, *more)))
    return known._replace(cause=to, score=known.score + weight, reasons=reasons)


def _factor(symptom: Symptom, cause: Cause, told: Words) -> float:
    """Returns the factor of a cure that was tried in vain, or makes the complaint worse."""
    is_lower = cause.direction is Direction.DOWN and cause.place.rpartition(".")[2] in SPEEDS
    against = AGAINST if is_lower and symptom is Symptom.TOO_SLOW else 1.0
    return against * (TRIED if is_among(cause, told.in_vain) else 1.0)


def _named_values(facts: Facts, told: Words) -> Iterator[Suspicion]:
    """Yields each number that a user names, in the directions that its value does not exclude."""
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
            cause = Cause(place, direction, None, "You named its value.")
            factor = value_factor(facts, cause)
            if factor >= WITHIN:
                evidence = Evidence(suspect=NAMED * factor)
                yield Suspicion(cause, 0.0, (cause.why,), evidence=evidence)


def _rests_on_given(facts: Facts, rule: Rule) -> bool:
    """Tells whether some value that a rule would change was given, or is the release's own."""
    return rule.cures[0].place == RELEASE or any(
        place in facts.given for cause in rule.cures for place in facts.matching(cause.place)
    )


def _merged(pieces: Sequence[Suspicion]) -> Suspicion:
    """Returns one suspicion for pieces of evidence, of which the strongest of each part counts."""
    pieces = sorted(pieces, key=lambda piece: (piece.evidence.words > 0.0, -piece.evidence.score))
    known = [piece.cause for piece in pieces if piece.cause.to is not None]
    reasons = tuple(dict.fromkeys(why for piece in pieces for why in piece.reasons if why))
    findings = tuple(finding for piece in pieces for finding in piece.findings)
    parts = zip(*(piece.evidence for piece in pieces), strict=True)
    cause = (*known, pieces[0].cause)[0]
    return Suspicion(cause, 0.0, reasons, findings, Evidence(*map(max, parts)))


def _times_named(facts: Facts, cause: Cause, told: Words) -> float:
    """Returns the number of times that a user's words or few values count as naming a cause."""
    if cause.is_outside:
        return 0.0
    if facts.told.get(cause.place) == "missing":
        return MISSING
    is_given = facts.is_told and any(p in facts.given for p in facts.matching(cause.place))
    return float(is_given or is_among(cause, told.named))
