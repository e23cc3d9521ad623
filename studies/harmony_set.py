"""harmony without the parts that its ablations found without worth, all taken out together.

`python studies/harmony_set.py FILE --first-round 200 --rounds N` drives it, a line a trial, and
goes on where FILE ends; --judge FILE drives nothing. The rule was committed before it was driven:

- The set: harmony_parts.SET and "plan so far and gentle stop", which is deleted since. Terms stay,
  as the publication names them, and so does the gatekeeper.
- harmony, and harmony without the set, drive units 127 to 130 of the 14 families of
  harmony_comparison.py, then rounds of the eleven living scenarios, each with Nav2's map and with
  beams that clear, from campaign seed 700 on (round 200), which no row has: as many whole rounds as
  40 minutes allow.
- Bytes first: a trial whose samples are equal to the last bit needs no statistics; its difference
  is 0.
- The set goes if, in families and in living rounds, each
  - no more trials end in a touch without it, and in the families none;
  - of the units in which only one of both does what is expected it does not lose more than chance
    allows (sign test, one-sided, p at least 0.05);
  - where both do what is expected, in parts of the margins of issue 49 (time 5%; path error 0.015 m
    or 20%, the larger; jerk 10%; abort time 0.2 s; clearance 0.02 m, as in the ablations; speed of
    the last sample of trials that give up 0.05 m/s, as metrics end there) the mean over families,
    or scenarios, is within the margin at its one-sided 95% limit (Student's t over their means);
  - in no family is the mean of a measure beyond its margin.
- Added while the families were driven, before any row was looked at: backing up and the notice of
  plans that get nowhere are for dead ends too narrow to turn in, which no family has. `--dead-ends
  20` drives that of the test suite (test_harmony_detour.DEAD_END), 20 draws of errors from seed 100
  on, and that many drives between two walls (SIDES) from which the goal lies behind: without the
  set it must arrive in as many. Else what is needed there is put back.
- What came out of the first set: it failed. Dead ends: 20 of 20 arrive, without the set 0; of the
  parts alone "backing up" loses them (8 of 8). Between the walls "backing up" (3 drives) and the
  notice (20) each lose all. At `restricted_large` it gives up at 0.42 m/s in place of 0.31 m/s,
  without "slow before giving up" alone, too. These three are put back. The other three are judged
  by the same rule on units 131 to 134 and rounds from 201 on.
- What came out of these three: 55 of 56 trials of the families are equal to the last bit, but among
  people the jerk rises by more than twice its margin in the first round already, so the drive ended
  there. Alone, "stop as a guess" raises it most, and lost an arrival in `clutter` of the first set;
  it is put back: a stop that is a guess does what the gentle stop does. The other two are judged by
  the same rule on units 135 to 138 and rounds from 203 on.
- What came out of these two: 55 of 56 trials of the families are equal, but among people time rises
  by half its margin, at most 1.5 of it, after the first round, so the drive ended there: "ways past
  that keep off" alone took `crossing` from 24.2 to 30.5 s in round 201. It is put back. One part is
  left, "plan so far and gentle stop". Trials of families that are equal without both sets that hold
  it are equal without it; the two others, and rounds from 205 on, are driven, a round as long as
  there is time. A trial in which the gatekeeper never refuses a plan is the same without it.
- What came out of it: it goes. Rounds 205 to 207; a fourth was not whole. Both trials of families,
  driven after it was deleted, are equal to the last bit, and so are the six trials among people
  that differ equal to those without it.
- If it fails, harmony drives the trials that decide against it without each part alone; the part
  that changes the failing measure most is put back, and the rest is judged by the same rule on the
  next units and rounds.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

import harmony_comparison as comparison
import harmony_judgement as judgement
import harmony_living as living
import numpy as np
import pandas as pd
from harmony_parts import PARTS, SET, watching, without
from question_trials import require_no_errors
from scipy import stats

from drake_navbench.campaign.trial_tasks import table_row
from drake_navbench.controllers.harmony import HarmonyParameters
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import drive

# The name of a column in a pair of columns.
WITHOUT = "without"
TESTS = Path(__file__).parents[1] / "tests"
UNITS = range(127, 131)
END_SPEED = judgement.Measure("end_speed_mps", 1.0, absolute=0.05)
MEASURES = {
    **{name: judgement.MEASURES[name] for name in ("time", "path error", "jerk")},
    "clearance": judgement.MEASURES["clearance"]._replace(absolute=0.02),
}
CLOSED_MEASURES = {"abort time": judgement.ABORT_TIME, "speed at the end": END_SPEED}
KEYS = ["map", "family", "scenario", "seed"]
KEPT = [
    *("column", *KEYS, "outcome", "digest"),
    *(measure.column for measure in (*MEASURES.values(), *CLOSED_MEASURES.values())),
]


def trials(folder: Path, units: range, rounds: range) -> list[tuple[str, str, TrialSpec]]:
    """Returns the map, the family or scenario, and harmony's trial, in the order of driving."""
    settings = {"seed": comparison.SEED, "first_worlds": comparison.FIRST_WORLDS}
    places = range(units.start - 1, units.stop - 1)
    asked = comparison.trials_of(folder, [judgement.OURS], units=places, **settings)
    found = [("families", family, spec) for family, spec in asked]
    for number in rounds:
        for name, clears in (("clearing", True), ("Nav2's map", False)):
            specs = living.specs_of(number, judgement.OURS, clears)
            found += [(name, spec.scenario.name, spec) for spec in specs]
    return found


def driven_row(spec: TrialSpec, parts: tuple[str, ...]) -> dict[str, Any]:
    """Returns the row of a trial of harmony driven without some parts."""
    sys.path.insert(0, str(TESTS / "trial"))
    from digests import digest

    with without(parts):
        log = drive(spec)
    speed = abs(float(log.samples["v_mps"].iloc[-1]))
    return table_row(log) | {"digest": digest(log), "end_speed_mps": speed}


def drive_missing(path: Path, units: range, rounds: range, parts: tuple[str, ...]) -> None:
    """Drives what a file does not hold yet, trial by trial, with the parts and without."""
    rows = pd.read_csv(path) if path.exists() else pd.DataFrame(columns=KEPT)
    driven = set(rows[["column", *KEYS]].itertuples(index=False, name=None))
    without_them = f"without {len(parts)} parts"
    with tempfile.TemporaryDirectory() as folder:
        for map_name, family, spec in trials(Path(folder), units, rounds):
            place = (map_name, family, spec.scenario.name, spec.seed)
            if (without_them, *place) in driven:
                continue
            with watching() as matter:
                whole = driven_row(spec, ())
            is_same = all(PARTS[part].watched for part in parts) and matter.isdisjoint(parts)
            part = whole if is_same else driven_row(spec, parts)
            lines = pd.DataFrame([whole, part]).assign(column=[judgement.OURS, without_them])
            lines = lines.assign(**dict(zip(KEYS, place, strict=True))).reindex(columns=KEPT)
            lines.to_csv(path, mode="a", header=not path.exists(), index=False)


def dead_ends(count: int, parts: tuple[str, ...]) -> None:
    """Prints how drives into the dead end of the test suite end, with the parts and without."""
    sys.path.insert(0, str(TESTS / "controllers" / "harmony"))
    from harmony_worlds import ERROR_M, drive_among
    from test_harmony_detour import DEAD_END, SIDES

    for place, boxes, yaw in (("dead end", DEAD_END, 0.0), ("turned away", SIDES, np.pi)):
        among = {"error_m": ERROR_M, "longest_s": 25.0, "yaw": yaw}
        for name, left_out in ((judgement.OURS, ()), ("without", parts)):
            with without(left_out):
                ends = [
                    drive_among(np.array(boxes), HarmonyParameters(), seed, **among).end
                    for seed in range(100, 100 + count)
                ]
            print(place, name, pd.Series(ends).value_counts().to_dict(), flush=True)


def tell(rows: pd.DataFrame) -> None:
    """Prints counts, then a row a group and measure, and their mean: in parts of the margins."""
    for column in rows["column"].unique():
        if column == judgement.OURS:
            continue
        pair = rows[rows["column"].isin([judgement.OURS, column])]
        wide = pair.replace({"column": {column: WITHOUT}}).pivot(index=KEYS, columns="column")
        wide = wide.dropna(subset=[("outcome", WITHOUT), ("outcome", judgement.OURS)])
        is_living = wide.index.get_level_values("map") != "families"
        for name, own in (("14 families", wide[~is_living]), ("living rounds", wide[is_living])):
            if not own.empty:
                table = differences(own)
                print(f"{column}, {name}: {counts(own)}\n")
                print(judgement.markdown(table), "\n")
                print(judgement.markdown(pooled(table)), "\n")


def counts(wide: pd.DataFrame) -> str:
    """Returns a sentence on trials: equal to the last bit, touches, and right ends."""
    equal = int((wide["digest", judgement.OURS] == wide["digest", WITHOUT]).sum())
    names = (judgement.OURS, WITHOUT)
    touch = [int((wide["outcome", name] == str(Outcome.COLLIDED)).sum()) for name in names]
    right, its = (judgement.succeeded(wide, name) for name in names)
    lost, gained = int((right & ~its).sum()), int((its & ~right).sum())
    p = stats.binomtest(lost, lost + gained, alternative="greater").pvalue if lost else 1.0
    return (
        f"{equal} of {len(wide)} trials are equal to the last bit; touches {touch[0]}, without "
        f"{touch[1]}; right ends {right.sum()}, without {its.sum()}: {lost} lost, "
        f"{gained} gained (p {p:.3f})"
    )


def differences(wide: pd.DataFrame) -> pd.DataFrame:
    """Returns a row a group and measure, where both did right: worse by, in margins."""
    found = []
    for family, group in wide.groupby(level="family"):
        is_closed = family in judgement.CLOSED
        both = judgement.succeeded(group, judgement.OURS) & judgement.succeeded(group, WITHOUT)
        for name, measure in (CLOSED_MEASURES if is_closed else MEASURES).items():
            pairs = group.loc[both, measure.column].astype(float).dropna()
            if pairs.empty:
                continue
            whole, part = pairs[judgement.OURS].mean(), pairs[WITHOUT].mean()
            worse = measure.sign * (part - whole) / measure.margin(whole)
            found.append([family, name, len(pairs), whole, part, worse])
    names = ["family", "measure", "units", judgement.OURS, WITHOUT, "in margins"]
    return pd.DataFrame(found, columns=names)


def pooled(table: pd.DataFrame) -> pd.DataFrame:
    """Returns a row a measure: the mean over groups, its limit, and the worst group, in margins."""
    found = []
    for name, group in table.groupby("measure", sort=False):
        values = group["in margins"]
        worst = group.loc[values.idxmax(), "family"]
        found.append([name, len(group), values.mean(), living.mean_bound(values)])
        found[-1] += [values.max(), worst]
    names = ["measure", "groups", "mean", "at most", "largest", "in"]
    return pd.DataFrame(found, columns=names)


def main() -> None:
    """Drives the set, or judges rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path, nargs="?")
    parser.add_argument("--dead-ends", type=int, default=0, metavar="N")
    parser.add_argument("--judge", action="store_true", help="drives nothing")
    parser.add_argument("--first-unit", type=int, default=UNITS.start)
    parser.add_argument("--units", type=int, default=len(UNITS))
    parser.add_argument("--first-round", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=0)
    parser.add_argument("--parts", nargs="+", choices=SET, default=list(SET))
    arguments = parser.parse_args()
    if (arguments.file is None) != (arguments.dead_ends > 0):
        parser.error("expected one of FILE and --dead-ends N")
    if arguments.dead_ends:
        dead_ends(arguments.dead_ends, tuple(arguments.parts))
        return
    if not arguments.judge:
        units = range(arguments.first_unit, arguments.first_unit + arguments.units)
        rounds = range(arguments.first_round, arguments.first_round + arguments.rounds)
        drive_missing(arguments.file, units, rounds, tuple(arguments.parts))
    if not arguments.file.is_file():
        parser.error(f"{arguments.file}: no such file")
    rows = pd.read_csv(arguments.file)
    require_no_errors(rows, arguments.file)
    tell(rows)


if __name__ == "__main__":
    main()
