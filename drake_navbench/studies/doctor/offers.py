"""Changes to try on the robot, which a visit leaves where no change is shown to help.

First come the changes that are shown to take the symptom away at a price, then those that helped in
too few trials to be shown, then the likeliest by reading. The last two are driven through the
probes beside the file as it is; one that makes something worse is left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.candidates import Candidates
from drake_navbench.studies.doctor.causes import Direction
from drake_navbench.studies.doctor.change import FRESH_SEEDS, compared
from drake_navbench.studies.doctor.differences import ways_back, with_differences
from drake_navbench.studies.doctor.driving import Driver
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.judged import Judged
from drake_navbench.studies.doctor.offer import Kind, Offer
from drake_navbench.studies.doctor.probes import nearest_first
from drake_navbench.studies.doctor.race import FIRST_LOOK, GLANCE
from drake_navbench.studies.doctor.symptoms import MILDER, Symptom
from drake_navbench.studies.doctor.tried import IDLE, LEAST_FALL, SAME, Tried, Verdict
from drake_navbench.studies.doctor.visited import Visit

MOST_OFFERS = 3
# The trials for the replays, for which search and comparisons leave time.
REPLAY_TRIALS = 4
# So many changes are compared with the file as it is at most: some make something worse.
MOST_COMPARED = 6


def note_offers(visit: Visit, patient: Patient, driver: Driver, near: Sequence[Symptom]) -> None:
    """Notes the changes to try; after Ctrl-C none is driven. near: as of `offers_of`."""
    try:
        with driver.keeping(REPLAY_TRIALS * driver.trial_s):
            drives = not visit.is_interrupted
            for offer in offers_of(visit, patient, driver, near, drives=drives):
                visit.offers.append(offer)
    except KeyboardInterrupt:
        visit.is_interrupted = True


def offers_of(
    visit: Visit, patient: Patient, driver: Driver, near: Sequence[Symptom], *, drives: bool = True
) -> Iterator[Offer]:
    """Yields the changes to try, the best first.

    near: the symptoms for which the first look looked first. drives: whether trials may be driven.
    """
    symptom, is_treated = _about(visit)
    if symptom is None or not visit.probes or (is_treated and visit.cure is not None):
        return
    probes = [visit.probes[name] for name in nearest_first(visit.probes, near)]
    candidates = Candidates(patient, symptom, probes[0], driver, seed=visit.seed)
    offered: set[str] = set()
    left = MOST_COMPARED
    for offer in _possible(visit, symptom, candidates, is_treated):
        found = offer
        if offer.tried.suspicion.cause.place in offered:
            continue
        if drives and left > 0 and offer.kind is not Kind.TRADE and not offer.is_idle:
            left -= 1
            judged = _compared(offer, patient, probes, driver, seed=visit.seed)
            if judged is not None and (judged.worse or judged.fails):
                driver.tell(f"  left out: more trials show {', '.join(judged.worse) or 'an error'}")
                continue
            found = replace(offer, judged=judged)
        yield found
        offered.add(offer.tried.suspicion.cause.place)
        if len(offered) == MOST_OFFERS:
            return


def _compared(
    offer: Offer, patient: Patient, probes: Sequence[Scenario], driver: Driver, *, seed: int
) -> Judged | None:
    """Compares an offer with the file as it is; returns None without time for a trial."""
    if driver.left_s <= 0.0:
        return None
    driver.tell(
        f"driving {offer.trial.told} through the probes, to see if it makes anything worse: "
        f"{driver.told_time(FRESH_SEEDS * len(probes))}"
    )
    return compared(offer.tried, patient, offer.symptom, probes, driver, seed=seed)


def _about(visit: Visit) -> tuple[Symptom | None, bool]:
    """Returns the symptom that the offers are for, and whether its causes were tried."""
    treated, complaint = visit.treated, visit.complaint
    is_treated = treated is not None and treated not in visit.rare
    own = [complaint, MILDER.get(complaint)] if complaint is not None else []
    if visit.of_complaint and not (is_treated and treated in own):
        return complaint, False
    return treated, is_treated


def _possible(
    visit: Visit, symptom: Symptom, candidates: Candidates, is_treated: bool
) -> Iterator[Offer]:
    """Yields the changes that may be offered, the best first."""
    known: set[tuple[str, Direction]] = {e.suspicion.cause.key for e in visit.tried if e.touches}
    if is_treated:
        trades = [judged for judged in visit.judged if judged.is_trade]
        for judged in sorted(trades, key=lambda j: (len(j.worse), j.left)):
            yield Offer(Kind.TRADE, judged.tried, judged.trial, symptom, judged)
        for entry in visit.tried:
            if entry.trial is not None and _has_helped(visit, entry):
                yield Offer(Kind.HELPED, entry, entry.trial, symptom)
        known |= {e.suspicion.cause.key for e in visit.tried if _is_driven(e)}
    suspicions = visit.suspicions if is_treated else visit.of_complaint or visit.suspicions
    back = ways_back(with_differences(suspicions, visit.facts), visit.facts)
    for suspicion in sorted([*back, *suspicions], key=lambda s: -s.score):
        if suspicion.cause.key in known:
            continue
        able, told = candidates.of(suspicion, most=1)
        if able:
            first = able[0].trial
            entry = Tried(suspicion, first, Verdict.NOT_TRIED)
            yield Offer(Kind.READ, entry, first, symptom)
            continue
        idle = next((e for e in told if e.reason == IDLE and e.trial is not None), None)
        if idle is not None and idle.trial is not None:
            yield Offer(Kind.READ, idle, idle.trial, symptom)


def _is_driven(entry: Tried) -> bool:
    """Tells whether the search has driven a change so far that its trials say something of it."""
    return entry.pairs >= GLANCE or entry.reason == SAME


def _has_helped(visit: Visit, entry: Tried) -> bool:
    """Tells whether a change lowered the severity in its trials, but is not judged to help."""
    is_judged = any(judged.tried is entry and judged.is_trade for judged in visit.judged)
    is_less = entry.fall >= LEAST_FALL and not entry.touches and entry.pairs >= FIRST_LOOK
    return bool(entry.trial) and is_less and not is_judged and not visit.is_refuted(entry)
