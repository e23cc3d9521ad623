"""Ablations of harmony: each part off, or in its plain form, against harmony as it is.

`python studies/harmony_ablations.py FILE` drives it, a line a trial, and goes on where FILE ends;
--judge FILE drives nothing. --columns drives some of the columns, so that two processes can share
them in files of their own. The rule was committed before anything was driven:

- Units 121 to 126, which no row has, of eleven families of harmony_comparison.py: without LEFT_OUT,
  whose trials take twice as long and whose paths are as free as that of `empty`. Every column
  drives unit 121 of every family. In a family that is a named scenario, a column whose trial 121
  equals harmony's is not driven further: the part does nothing there, its difference is 0.
- Amended after the first four columns, before any row was looked at, as the computer was shared:
  named scenarios, whose trials differ only by the draws of sensors, end with unit 123 (harmony's
  own and the first three parts have six); parts that change little stand before the others.
- A trial of harmony in which no function of a part returns something else than its replacement
  would is not driven without the part: it would be the same, so its row is that of harmony.
- Columns are driven in the order of harmony_parts.COLUMNS, each whole. Those that the time does not
  reach are named as not driven; a column of which units are missing counts as not driven.
- Beside them ON_OTHER_ROBOTS: robots whose commands are late, or whose time constant harmony is
  told wrong, in four families, against harmony on the same robot.
- Measures by family, paired by unit, where both arrive: time (abort time where the way is closed),
  path error, jerk with the margins of the comparison, and clearance (margin CLEARANCE_M).
  Arrivals over all families: the sign test. Pooled: the mean over families of the differences in
  parts of their margins. All limits one-sided at 95%.
- A part *shows worth* if harmony is worse without it in a measure of a family, a pooled measure or
  the arrivals, by Holm over all comparisons of all parts and by a tenth of the margin or more, or
  if it touches something without it.
- A part *goes* if it shows no worth, no family arrives in fewer units without it, no measure of a
  family and no pooled one is beyond its margin at the limit. Terms stay: the publication asks for
  the twelve; those without worth are named. So do parts that the stop for moving things, driving
  away from people or the statement rest on: the gatekeeper, the prediction, the learning.
- All that goes is taken out together and judged once more by units 127 to 130, pooled: no arrival
  less, no touch, no pooled measure beyond its margin in the mean. Else it stays.
- The gatekeeper, too, in --safety N worlds of harmony_worlds.py that nobody has driven, from
  SAFETY_FIRST on, in which the pose is wrong by the whole bound: touches with it and without.

Driving away from who stands in the way is not driven: in these families nothing moves, and its
worth among people stands in docs/harmony.md.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import tempfile
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

import harmony_comparison as comparison
import harmony_judgement as judgement
import numpy as np
import pandas as pd
from harmony_families import FAMILIES
from harmony_parts import COLUMNS, GONE, LATE, ON_OTHER_ROBOTS, PARTS, ROBOT_FAMILIES, watching
from question_trials import require_no_errors
from scipy import stats

from drake_navbench.analysis.pairs import holm
from drake_navbench.campaign.rows_of_trials import with_column
from drake_navbench.campaign.trial_tasks import table_row
from drake_navbench.inputs.presets import load_preset
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import drive

FIRST, LAST, LAST_OF_NAMED = 121, 126, 123
# Fewer units decide nothing; the comparison asks for six.
LEAST_UNITS = 3
# Chances of a false alarm, over all comparisons; less worth than this, in margins, is none.
ALPHA, LEAST_WORTH = 0.05, 0.1
LEFT_OUT = ("one_obstacle", "static_obstacles", "everyday")
OPEN = tuple(one for one in comparison.ORDER if one not in (*judgement.CLOSED, *LEFT_OUT))
CLEARANCE_M = 0.02
SAFETY_FIRST = 20_000
MEASURES = {
    **{name: judgement.MEASURES[name] for name in ("time", "path error", "jerk")},
    "clearance": judgement.MEASURES["clearance"]._replace(absolute=CLEARANCE_M),
}
# The parts without which a trial of harmony would be another one, of those that are watched.
MATTERS = "matters"
KEPT = ["column", *comparison.KEPT[1:4], *comparison.KEPT[5:], MATTERS]


KEYS = ["column", "family", "scenario", "seed"]


def spec_of(spec: TrialSpec, name: str) -> TrialSpec:
    """Returns a trial of harmony as one of a column."""
    (found,) = with_column([spec], load_preset(f"{judgement.OURS}{COLUMNS[name].settings}"))
    if name.startswith("late"):
        found = replace(found, robot=found.robot.model_copy(update={"timing": LATE}))
    return found


def drive_missing(path: Path, columns: list[str], units: range, folder: Path) -> None:
    """Drives what a file does not hold yet, column by column, in this process."""
    settings = {"seed": comparison.SEED, "first_worlds": comparison.FIRST_WORLDS}
    asked = [
        (unit, family, spec)
        for unit in units
        for family, spec in comparison.trials_of(
            folder, [judgement.OURS], units=range(unit - 1, unit), **settings
        )
        if family not in LEFT_OUT
    ]
    for name, (unit, family, spec) in itertools.product(columns, asked):
        if name in ON_OTHER_ROBOTS and family not in ROBOT_FAMILIES:
            continue
        rows = pd.read_csv(path) if path.exists() else pd.DataFrame(columns=KEPT)
        key = dict(zip(KEYS, (name, family, spec.scenario.name, spec.seed), strict=True))
        is_driven = (rows[KEYS] == pd.Series(key)).all(axis=1).any()
        is_known = family not in FAMILIES and unit in range(LAST_OF_NAMED + 1, LAST + 1)
        is_known = is_known or (unit > units[0] and does_nothing(rows, name, family))
        if is_driven or is_known:
            continue
        row = None if not COLUMNS[name].watched else row_without_matter(rows, key)
        if row is None:
            row = driven_row(spec, name)
        line = pd.DataFrame([row | key]).reindex(columns=KEPT)
        line.to_csv(path, mode="a", header=not path.exists(), index=False)
        print(unit, *key.values(), row["outcome"], flush=True)


def driven_row(spec: TrialSpec, name: str) -> dict[str, Any]:
    """Returns the row of a trial of harmony driven without a part; of harmony, what matters."""
    with COLUMNS[name].off(), ExitStack() as stack:
        matters = stack.enter_context(watching()) if name == judgement.OURS else set()
        row = table_row(drive(spec_of(spec, name)))
    return row | {MATTERS: "; ".join(sorted(matters))}


def row_without_matter(rows: pd.DataFrame, key: dict[str, Any]) -> dict[str, Any] | None:
    """Returns harmony's row of a trial in which a part does not matter, else None."""
    of_harmony = pd.Series(key | {"column": judgement.OURS})
    found = rows[(rows[KEYS] == of_harmony).all(axis=1)]
    if found.empty or key["column"] in str(found[MATTERS].iloc[0]).split("; "):
        return None
    return found.drop(columns=MATTERS).iloc[0].to_dict()


def does_nothing(rows: pd.DataFrame, name: str, family: str) -> bool:
    """Returns whether the column's first trial of a named scenario equals the one it is held to."""
    against = COLUMNS[name].against
    if family in FAMILIES or name == against:
        return False
    mine, its = (
        rows[(rows["column"] == one) & (rows["family"] == family)].drop(columns=["column", MATTERS])
        for one in (name, against)
    )
    if mine.empty or its.empty:
        return False
    return mine[:1].reset_index(drop=True).equals(its[:1].reset_index(drop=True))


def compared(rows: pd.DataFrame, name: str) -> pd.DataFrame:
    """Returns a row a family and measure, and pooled: how much worse harmony is without the part.

    in margins: the difference in parts of the margin, and its limit. p: that it is not worse.
    """
    against = COLUMNS[name].against
    pair = rows[rows["column"].isin([name, against])]
    pair = pair.assign(
        controller=pair["column"].map({name: judgement.OURS, against: "whole"})
    ).drop(columns="column")
    trials, found = judgement.wide(pair), []
    for family, group in trials.groupby(level="family"):
        is_closed = family in judgement.CLOSED
        measures = {"abort time": judgement.ABORT_TIME} if is_closed else MEASURES
        for measure_name, measure in measures.items():
            with mock.patch.object(judgement, "LEAST_UNITS", LEAST_UNITS):
                told = judgement.difference(group, measure, "whole")
            if told is None or not np.isfinite(told.upper):
                continue
            margin = measure.margin(told.rival)
            found.append([family, measure_name, *told[:3], told.worse_by / margin])
            found[-1] += [told.upper / margin, _p_worse(told)]
    names = ["family", "measure", "units", "ours", "whole", "in margins", "at most", "p"]
    return pd.DataFrame(found, columns=names)


def _p_worse(told: judgement.Difference) -> float:
    if told.upper == told.worse_by:
        return float(told.worse_by <= 0.0)
    quantile = stats.t.ppf(judgement.CONFIDENCE, told.units - 1)
    error = (told.upper - told.worse_by) / quantile
    return float(stats.t.sf(told.worse_by / error, told.units - 1))


def with_pooled(table: pd.DataFrame, families: int) -> pd.DataFrame:
    """Returns the table with a row a measure, the mean over families; those not driven count 0."""
    found = []
    for name, group in table[table["family"].isin(OPEN)].groupby("measure"):
        errors = (group["at most"] - group["in margins"]) / stats.t.ppf(
            judgement.CONFIDENCE, group["units"] - 1
        )
        mean, error = group["in margins"].sum() / families, np.sqrt((errors**2).sum()) / families
        # Welch and Satterthwaite.
        freedom = (errors**2).sum() ** 2 / max((errors**4 / (group["units"] - 1)).sum(), 1e-300)
        row = {"family": "pooled", "measure": name, "units": group["units"].sum()}
        row |= {"in margins": mean, "p": float(mean <= 0.0)}
        row["at most"] = mean
        if error > 0.0:
            row["at most"] = mean + stats.t.ppf(judgement.CONFIDENCE, max(freedom, 1.0)) * error
            row["p"] = stats.t.sf(mean / error, max(freedom, 1.0))
        found.append(row)
    return pd.concat([table, pd.DataFrame(found)], ignore_index=True)


def arrivals(rows: pd.DataFrame, name: str) -> dict[str, Any]:
    """Returns in how many units only harmony, and only harmony without the part, does right."""
    against = COLUMNS[name].against
    trials = judgement.wide(rows.rename(columns={"column": "controller"}))
    own = trials.dropna(subset=[("outcome", one) for one in (name, against)])
    mine, its = (judgement.succeeded(own, one) for one in (name, against))
    lost, gained = int((its & ~mine).sum()), int((mine & ~its).sum())
    by_family = pd.Series(mine).groupby(own.index.get_level_values("family")).sum()
    by_family -= pd.Series(its).groupby(own.index.get_level_values("family")).sum()
    p_value = stats.binomtest(lost, lost + gained, alternative="greater").pvalue if lost else 1.0
    return {
        "units": len(own),
        "lost": lost,
        "gained": gained,
        "fewer in": ", ".join(by_family.index[by_family < 0]),
        "touches": int((own["outcome", name] == str(Outcome.COLLIDED)).sum()),
        "p": p_value,
    }


def tell(rows: pd.DataFrame) -> None:
    """Prints a row a part: how harmony changes without it, and what the rule says of it.

    Measures are the means over families, path error in parts of its margin. shown, limit beyond:
    families and measures, in margins.
    """
    # Every column drives all worlds, so that one with fewer of them is not whole.
    in_worlds = rows[rows["family"].isin(FAMILIES)].groupby("column").size()
    units = in_worlds[judgement.OURS] // len(FAMILIES)
    driven = {name: ROBOT_FAMILIES if name in ON_OTHER_ROBOTS else FAMILIES for name in COLUMNS}
    whole = [
        name
        for name, families in driven.items()
        if in_worlds.get(name, 0) == units * len(FAMILIES.keys() & set(families))
    ]
    print("not driven:", ", ".join(name for name in COLUMNS if name not in whole), "\n")
    names = [name for name in COLUMNS if name in whole and name != COLUMNS[name].against]
    tables = {}
    for name in names:
        families = len(ROBOT_FAMILIES) if name in ON_OTHER_ROBOTS else len(OPEN)
        tables[name] = with_pooled(compared(rows, name), families)
    counts = {name: arrivals(rows, name) for name in names}
    everything = pd.concat(tables, names=["part"]).reset_index("part")
    adjusted = holm([*everything["p"], *(one["p"] for one in counts.values())])
    everything["holm"] = adjusted[: len(everything)]
    lines = []
    for name, told in zip(names, adjusted[len(everything) :], strict=True):
        mine, count = everything[everything["part"] == name], counts[name]
        worth = mine[(mine["holm"] < ALPHA) & (mine["in margins"] >= LEAST_WORTH)]
        words = [
            f"{one.family} {one.measure} {one._6:+.1f}" for one in worth.itertuples(index=False)
        ]
        beyond = mine[mine["at most"] > 1.0 + 1e-12]
        has_worth = bool(words) or told < ALPHA or count["touches"] > 0
        is_good = beyond.empty and not count["fewer in"]
        pooled = mine[mine["family"] == "pooled"].set_index("measure")["in margins"]
        lines.append(
            {
                "without": name,
                "arrivals lost, gained": f"{count['lost']}, {count['gained']} of {count['units']}",
                "touches": count["touches"],
                "time": f"{100.0 * MEASURES['time'].ratio * pooled.get('time', 0.0):+.1f}%",
                "path error": f"{pooled.get('path error', 0.0):+.2f}",
                "jerk": f"{100.0 * MEASURES['jerk'].ratio * pooled.get('jerk', 0.0):+.0f}%",
                "clearance [m]": f"{-CLEARANCE_M * pooled.get('clearance', 0.0):+.3f}",
                "shown": "; ".join(words) + ("; arrivals" if told < ALPHA else ""),
                "fewer arrive in": count["fewer in"],
                "limit beyond": "; ".join(map(" ".join, beyond[["family", "measure"]].to_numpy())),
                "rule": "worth" if has_worth else "goes" if is_good else "not shown",
            }
        )
    print(judgement.markdown(pd.DataFrame(lines)))


def safety(count: int) -> None:
    """Prints how many worlds end how, with the gatekeeper and without."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "controllers" / "harmony"))
    import harmony_worlds

    for name in (judgement.OURS, "gatekeeper"):
        with PARTS[name].off():
            ends = [
                harmony_worlds.drive(seed).end for seed in range(SAFETY_FIRST, SAFETY_FIRST + count)
            ]
        print(name, pd.Series(ends).value_counts().to_dict(), flush=True)


def main() -> None:
    """Drives the ablations, or judges rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path, nargs="?")
    parser.add_argument("--judge", type=Path, nargs="+", metavar="FILE", help="drives nothing")
    driven = [name for name in COLUMNS if name not in GONE]
    parser.add_argument("--columns", nargs="+", choices=driven, default=driven)
    parser.add_argument("--first", type=int, default=FIRST)
    parser.add_argument("--last", type=int, default=LAST)
    parser.add_argument("--safety", type=int, default=0, metavar="N")
    arguments = parser.parse_args()
    if sum((arguments.file is not None, arguments.judge is not None, arguments.safety > 0)) != 1:
        parser.error("expected one of FILE, --judge FILE and --safety N")
    missing = [path for path in arguments.judge or () if not path.is_file()]
    if missing:
        parser.error(f"--judge {missing[0]}: no such file")
    if arguments.safety:
        safety(arguments.safety)
    elif arguments.judge is not None:
        rows = pd.concat([pd.read_csv(path) for path in arguments.judge]).drop_duplicates(KEYS)
        require_no_errors(rows, arguments.judge[0])
        tell(rows)
    else:
        with tempfile.TemporaryDirectory() as folder:
            units = range(arguments.first, arguments.last + 1)
            drive_missing(arguments.file, arguments.columns, units, Path(folder))


if __name__ == "__main__":
    main()
