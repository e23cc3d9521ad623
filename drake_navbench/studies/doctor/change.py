"""The change: the smallest set that takes the symptom away and makes no other one worse.

It is judged once on all probes. Probes that the search has driven get fresh seeds. The other probes
keep the first look's seeds: the unchanged file was driven there before any change was chosen, and
the changed file has not been driven there. Where the budget ends it, the judgement rests on the
trials so far, and tells how many it lacks.

One further touch in all trials may be chance. If nothing else speaks against a change, it and the
file as it is drive the probes with that touch again, with AGAIN_SEEDS seeds that nothing else has
used. The touch counts against the change if more of these trials touch with it than without, or if
there is no time for all of them; else it counts as chance, and the verdict tells it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from statistics import fmean

from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.driving import (
    AGAIN_SEED,
    FRESH_SEED,
    Driver,
    Row,
    has_failed,
    is_same,
    probe_of,
    severity,
    shows,
)
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.judged import LEAST_SHOWN, Again, Judged, best_of
from drake_navbench.studies.doctor.probes import nearest_first
from drake_navbench.studies.doctor.race import CHANCE, CUTS_SHORT
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import Tried, Verdict

# Sets that are judged at most, the likeliest first.
MOST_JUDGED = 3
FRESH_SEEDS = 2
# If fewer trials than LEAST_SHOWN show the symptom before the change, the probes that showed it
# get more seeds; if then still fewer do, none is judged: what one trial shows may be chance.
MORE_FRESH_SEEDS = 8
# Seeds of a probe in which one further touch is looked for again. A touch that comes in a quarter
# of the trials is missed in 16 of these once in a hundred times, one in a tenth once in five.
AGAIN_SEEDS = 16
# What comes in place of an early end, and is compared where the file as it is ends early, too.
ENDS = (*CUTS_SHORT, Symptom.GOAL_NOT_REACHED)


def judge(
    patient: Patient,
    tried: Sequence[Tried],
    symptom: Symptom,
    probes: Mapping[str, Scenario],
    showing: Sequence[str],
    driver: Driver,
    *,
    seed: int,
    bar: float = 1.0,
) -> Iterator[Judged]:
    """Yields the judgements of the best changes, until one helps and brings nothing else.

    Of several changes that take the symptom away, all are judged while the budget lasts: one may
    only make up for the cause and leave its other symptoms. No further change is judged once one
    leaves other symptoms in at most one trial. The smallest sets come first. Where the budget does
    not suffice for one seed of the probes that showed the symptom, nothing is judged. seed: of the
    visit. bar: the severity above which a trial shows the symptom.
    """
    shown = [e for e in tried if e.verdict is Verdict.SHOWN and e.trial is not None]
    enough = [e for e in shown if e.takes_all or e.after <= 0.5 * bar] or shown
    # Stable: the likelier cause stays first.
    enough.sort(key=lambda e: (len(e.trial.changes) if e.trial else 0, not e.takes_all))
    own = {name: probes[name] for name in showing}
    others = nearest_first(probes, (symptom, Symptom.COLLISION))
    rest = {name: probes[name] for name in others if name not in own}
    judged: list[Judged] = []
    for entry in enough[:MOST_JUDGED]:
        best = best_of(judged)
        if best is not None and not best.worse:
            is_best = best.left <= CHANCE
            if is_best or not entry.takes_all or driver.left_s <= 0.0:
                return
        assert entry.trial is not None
        both = patient.before_and_after(entry.trial.changes)
        found = _judgement(entry, both, own, rest, driver, symptom=symptom, seed=seed, bar=bar)
        if found is None:
            return
        judged.append(found)
        yield found
        if found.is_rare:
            # No change can be judged if the symptom hardly shows on fresh seeds.
            return


def _judgement(
    entry: Tried,
    both: Sequence[Preset],
    own: Mapping[str, Scenario],
    rest: Mapping[str, Scenario],
    driver: Driver,
    *,
    symptom: Symptom,
    seed: int,
    bar: float,
) -> Judged | None:
    """Drives a change, and the file as it is where it was not driven; None without time for it.

    both: the columns before and after. own, rest: the probes that showed the symptom, the others.
    """
    assert entry.trial is not None
    count = trials_to_judge(len(own), len(own) + len(rest))
    driver.tell(
        f"judging {entry.trial.told} on fresh seeds: up to {count} trials, "
        f"{driver.told_time(count)}"
    )
    seeds, fresh = FRESH_SEEDS, seed + FRESH_SEED
    rows = _whole_seeds(driver, both, list(own.values()), seeds, seed=fresh)
    if sum(shows(row, symptom, bar) for row in rows[0]) < LEAST_SHOWN and driver.left_s > 0.0:
        driver.tell(
            f"the symptom is rare: {MORE_FRESH_SEEDS - FRESH_SEEDS} more fresh seeds of the "
            "probes that showed it"
        )
        seeds = MORE_FRESH_SEEDS
        rows = _whole_seeds(driver, both, list(own.values()), seeds, seed=fresh)
    if not rows[0]:
        return None
    found = _judged(entry, entry.trial, rows, rows, symptom, tuple(own), bar)
    found = replace(found, lacking=seeds * len(own) - len(rows[0]))
    # A change that leaves the symptom does not help, whatever the other probes show.
    if not found.is_gone:
        return found
    further = driver.drive_nearest(both, list(rest.values()), FRESH_SEEDS, seed=seed)
    everything = [these + more for these, more in zip(rows, further, strict=True)]
    whole = _judged(entry, entry.trial, everything, rows, symptom, tuple(own), bar)
    driven = {probe_of(row) for row in further[0]}
    whole = replace(
        whole,
        lacking=found.lacking + FRESH_SEEDS * len(rest) - len(further[0]),
        undriven=tuple(name for name in rest if name not in driven),
    )
    if not whole.has_one_touch_more:
        return whole
    touching = [probe for name, probe in {**own, **rest}.items() if _touches_more(everything, name)]
    return replace(whole, again=_again(both, touching, driver, seed=fresh + AGAIN_SEED))


def _touches_more(rows: Sequence[Sequence[Row]], probe: str) -> bool:
    """Tells whether more trials of a probe touch with a change. rows: before and after."""
    before, after = (
        sum(shows(row, Symptom.COLLISION) for row in these if probe_of(row) == probe)
        for these in rows
    )
    return after > before


def _again(
    both: Sequence[Preset], probes: Sequence[Scenario], driver: Driver, *, seed: int
) -> Again | None:
    """Drives probes with and without a change to see touches again; None without the time."""
    count = AGAIN_SEEDS * len(probes)
    names = ", ".join(probe.name.removeprefix("probe_") for probe in probes)
    driver.tell(
        f"one further touch, in {names}: up to {2 * count} more trials tell whether it was chance, "
        f"{driver.told_time(2 * count)}"
    )
    rows = driver.drive_nearest(both, probes, AGAIN_SEEDS, seed=seed)
    if len(rows[0]) < count:
        return None
    before, after = (sum(shows(row, Symptom.COLLISION) for row in these) for these in rows)
    driver.tell(f"  touches in {count} trials: {before} before the change, {after} with it")
    return Again(count, before, after)


def compared(
    entry: Tried,
    patient: Patient,
    symptom: Symptom,
    probes: Sequence[Scenario],
    driver: Driver,
    *,
    seed: int,
) -> Judged | None:
    """Returns a change on the first look's trials, beside the file as it is; None without time.

    It tells whether the change makes something worse; if it does in the first seed of the probes,
    no second one is driven. probes: those driven first come first. seed: of the first look.
    """
    assert entry.trial is not None
    both = patient.before_and_after(entry.trial.changes)
    found = None
    for seeds in range(1, FRESH_SEEDS + 1):
        rows = driver.drive_nearest(both, probes, seeds, seed=seed)
        if rows[0]:
            found = _judged(entry, entry.trial, rows, rows, symptom, (), 1.0)
            found = replace(found, lacking=FRESH_SEEDS * len(probes) - len(rows[0]))
        if found is None or found.worse or found.fails:
            break
    return found


def trials_to_judge(own: int, probes: int) -> int:
    """Returns the trials of a judgement, if the symptom is not rare.

    own: the probes that showed it. On the others the first look has driven the unchanged file.
    """
    return (2 * own + probes - own) * FRESH_SEEDS


def _whole_seeds(
    driver: Driver, both: Sequence[Preset], own: Sequence[Scenario], seeds: int, *, seed: int
) -> list[list[Row]]:
    """Returns the rows before and after of those seeds for which all probes could be driven."""
    rows = driver.drive_nearest(both, own, seeds, seed=seed)
    count = len(rows[0]) // len(own) * len(own)
    return [these[:count] for these in rows]


def _comparable(old: Sequence[Row], symptom: Symptom, treated: Symptom) -> list[int]:
    """Returns the indices of the trials in which the file as it is could have shown a symptom."""
    if symptom is Symptom.COLLISION:
        return list(range(len(old)))
    is_last = symptom in ENDS or symptom is treated
    return [
        index
        for index, row in enumerate(old)
        if not (shows(row, Symptom.COLLISION) if is_last else _is_cut(row))
    ]


def _is_cut(row: Row) -> bool:
    """Tells whether a drive ended early, so that it may miss what would follow."""
    return any(shows(row, symptom) for symptom in CUTS_SHORT)


def _fails(old: Sequence[Row], new: Sequence[Row]) -> bool:
    return any(has_failed(b) and not has_failed(a) for a, b in zip(old, new, strict=True))


def _judged(
    entry: Tried,
    trial: Trial,
    everything: Sequence[Sequence[Row]],
    target: Sequence[Sequence[Row]],
    symptom: Symptom,
    showing: Sequence[str],
    bar: float,
) -> Judged:
    """Returns a judgement. everything, target: rows [before or after, trial] of all that was driven
    and of the probes that showed the symptom."""
    old, new = everything
    where = {s: _comparable(old, s, symptom) for s in Symptom}
    rest = [i for i in where[Symptom.COLLISION] if not _is_cut(old[i])]
    others = {s: [i for i in range(len(old)) if i not in where[s]] for s in Symptom}
    instead = {s.value: sum(shows(new[i], s) for i in others[s]) for s in Symptom}
    before, after = ([severity(row, symptom) for row in rows] for rows in target)
    falls = [a - b for a, b in zip(before, after, strict=True)]
    return Judged(
        entry,
        trial,
        len(old),
        len(rest),
        {s.value: sum(shows(old[i], s) for i in where[s]) for s in Symptom},
        {s.value: sum(shows(new[i], s) for i in where[s]) for s in Symptom},
        sum(shows(row, symptom, bar) for row in target[0]),
        sum(shows(row, symptom, bar) for row in target[1]),
        len(before),
        {name: count for name, count in instead.items() if count},
        tuple(showing),
        falls.index(max(falls)),
        symptom,
        _fails(old, new),
        same=sum(map(is_same, old, new)),
        before_mean=fmean(before),
        after_mean=fmean(after),
    )
