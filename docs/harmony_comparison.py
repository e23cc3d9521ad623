"""The comparison of harmony.md: `python docs/harmony_comparison.py FOLDER` drives and judges it.

Writes random worlds into FOLDER/worlds, a line for each trial into FOLDER/trials.csv, and prints
the tables in Markdown. It goes on where the file ends, round by round: one trial of every named
scenario and one world, each by every column, so that whatever is there is paired. A column whose
code has changed must be deleted from the file. Margins, seeds and worlds stand here and on the
page; both were committed before the run.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import yaml
from scipy import stats

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.trial_tasks import table_row
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS
from drake_navbench.log import Outcome
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.tuning.pairs import drive_each

OURS = "harmony"
RIVALS = ("dwb", "rpp", "teb", "mppi", "mppi_nav2", "dwb_tuned", "mppi_tuned")
ABLATIONS = {
    "without sampler": "harmony:use_sampler=false",
    "without program": "harmony:use_program=false",
    "without gatekeeper": "harmony:use_gatekeeper=false",
    "without groups": "harmony:use_groups=false",
}
# Where giving up is what is expected.
IMPOSSIBLE = ("restricted_small", "restricted_large")
CONFIDENCE = 0.95
# What counts: the trials of this seed, and worlds from this number on. Nothing was tuned in them.
# Seeds 0, 100 and 200, worlds from 9100, 9200 and 9300 on were those of comparisons before; worlds
# from 9000 and 9900 on, and seeds of 1000 and more, are what harmony was tuned by.
SEED = 300
FIRST_WORLD, BOXES = 9400, 6


class Measure(NamedTuple):
    """A column of the results. sign: 1 where less is better. margin: how much worse is allowed.

    relative: the margin is a part of the rival's mean.
    """

    column: str
    sign: float
    margin: float
    relative: bool = False


MEASURES = {
    "success": Measure("succeeded", -1.0, 0.02),
    "collisions": Measure("collided", 1.0, 0.0),
    "time [s]": Measure("time_to_goal_s", 1.0, 0.05, True),
    "clearance [m]": Measure("min_clearance_m", -1.0, 0.03),
    "path error [m]": Measure("cross_track_error_mean_m", 1.0, 0.03),
    "jerk, rms [m/s^3]": Measure("jerk_rms_mps3", 1.0, 0.1, True),
    "lateral acceleration, max [m/s^2]": Measure("lateral_acceleration_max_mps2", 1.0, 0.1, True),
    "abort time [s]": Measure("aborted_s", 1.0, 0.2),
}


def write_world(folder: Path, seed: int) -> Path:
    """Writes a scenario with random boxes between walls, through which the planner finds a way."""
    random = np.random.default_rng(seed)
    obstacles = [
        {"type": "box", "min": [-1.5, side - 0.1], "max": [9.5, side + 0.1]} for side in (-2.6, 2.6)
    ]
    while len(obstacles) < BOXES + 2:
        low = random.uniform([1.3, -2.4], [6.4, 1.9])
        high = low + random.uniform(0.15, 0.6, 2)
        obstacles.append(
            {"type": "box", "min": low.round(3).tolist(), "max": high.round(3).tolist()}
        )
    scenario = {
        "description": f"Random world {seed}",
        "world": {"obstacles": obstacles},
        "goal": [8.0, round(float(random.uniform(-1.2, 1.2)), 3), 0.0],
        "timeout_s": 60.0,
    }
    path = folder / f"world_{seed}.yaml"
    path.write_text(yaml.safe_dump(scenario), encoding="utf-8")
    return path


def judged(trials: pd.DataFrame) -> pd.DataFrame:
    """Returns the measures that are no columns yet, beside those that are."""
    impossible = trials.scenario.isin(IMPOSSIBLE)
    succeeded = np.where(
        impossible, trials.outcome == Outcome.ABORTED, trials.outcome == Outcome.SUCCEEDED
    )
    return trials.assign(
        succeeded=succeeded.astype(float),
        collided=(trials.outcome == Outcome.COLLIDED).astype(float),
        aborted_s=trials.simulated_time_s.where(impossible & (trials.outcome == Outcome.ABORTED)),
    )


def comparison(trials: pd.DataFrame) -> pd.DataFrame:
    """Returns one row a measure: ours, the best rival, and what is shown of the difference.

    The best rival is that of the better mean over the pairs that both have. A pair is a scenario
    and a seed; not inferior means that the one-sided interval of the mean difference stays within
    the margin, superior that it stays below 0 with Holm's correction over the measures.
    """
    rows, p_values = [], []
    for name, measure in MEASURES.items():
        wide = trials.pivot_table(
            index=["scenario", "seed"], columns="controller", values=measure.column
        ).reindex(columns=[OURS, *RIVALS])
        rivals = [rival for rival in RIVALS if wide[rival].notna().any()]
        if not rivals or wide[OURS].isna().all():
            # Such as the time to abort, where nobody had to.
            continue
        pairs = wide.dropna(subset=[OURS, *rivals])
        best = min(rivals, key=lambda rival: measure.sign * pairs[rival].mean())
        worse = measure.sign * (pairs[OURS] - pairs[best])
        margin = measure.margin * (abs(pairs[best].mean()) if measure.relative else 1.0)
        error = worse.std(ddof=1) / np.sqrt(len(worse)) if len(worse) > 1 else np.inf
        upper = worse.mean() + stats.t.ppf(CONFIDENCE, max(len(worse) - 1, 1)) * error
        p_value = 1.0
        if error > 0.0 and np.isfinite(error):
            p_value = float(stats.t.cdf(worse.mean() / error, len(worse) - 1))
        p_values.append(p_value)
        rows.append(
            {
                "measure": name,
                "pairs": len(pairs),
                "harmony": pairs[OURS].mean(),
                "best rival": best,
                "its mean": pairs[best].mean(),
                "worse by": worse.mean(),
                "at most": upper,
                "margin": margin,
                "not inferior": "yes" if upper <= margin + 1e-12 else "no",
            }
        )
    table = pd.DataFrame(rows)
    table["superior"] = np.where(_holm(np.array(p_values)) < 1.0 - CONFIDENCE, "yes", "no")
    return table


def _holm(p_values: np.ndarray) -> np.ndarray:
    order = np.argsort(p_values)
    scaled = p_values[order] * np.arange(len(p_values), 0, -1)
    corrected = np.empty(len(p_values))
    corrected[order] = np.minimum(np.maximum.accumulate(scaled), 1.0)
    return corrected


def means(trials: pd.DataFrame, names: dict[str, str]) -> pd.DataFrame:
    """Returns the means of the measures, a row for each of the columns."""
    found = trials.groupby("controller")[[m.column for m in MEASURES.values()]].mean()
    shown = found.reindex(list(names.values()))
    shown.index = list(names)
    return shown.set_axis(list(MEASURES), axis=1)


def markdown(table: pd.DataFrame) -> str:
    """Returns a table in Markdown, numbers with three decimals."""
    rows = [list(map(str, table.columns)), ["---"] * len(table.columns)]
    for values in table.itertuples(index=False):
        rows.append([f"{v:.3f}" if isinstance(v, float) else str(v) for v in values])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def rounds(
    scenarios: Sequence[str], worlds: list[Path], columns: Sequence[str], trials: int
) -> list[list[TrialSpec]]:
    """Returns what to drive: in each round a trial of every named scenario, and a world."""
    named = plan_campaign(
        scenarios,
        columns,
        trials=trials,
        seed=SEED,
        keeps_costmaps=False,
    )
    found: list[list[TrialSpec]] = [[] for _ in range(max(trials, len(worlds)))]
    for spec in named.specs:
        found[spec.trial].append(spec)
    for place, path in enumerate(worlds):
        random = plan_campaign([str(path)], columns, trials=1, seed=SEED, keeps_costmaps=False)
        found[place].extend(random.specs)
    return found


def drive_missing(path: Path, asked: list[list[TrialSpec]], jobs: int) -> pd.DataFrame:
    """Drives what a file of trials does not hold yet, and returns the asked ones."""
    kept = pd.read_csv(path) if path.exists() else pd.DataFrame({"identity": []})
    for number, specs in enumerate(asked):
        missing = [spec for spec in specs if spec.identity not in set(kept.identity)]
        if not missing:
            continue
        rows = pd.DataFrame(drive_each(missing, table_row, jobs=jobs))
        rows.insert(0, "identity", [spec.identity for spec in missing])
        kept = rows if kept.empty else pd.concat([kept, rows], ignore_index=True)
        partial = path.with_suffix(".partial")
        kept.to_csv(partial, index=False)
        partial.replace(path)
        print(f"round {number + 1} of {len(asked)} is driven", flush=True)
    identities = {spec.identity for specs in asked for spec in specs}
    return kept[kept.identity.isin(identities)]


def main() -> None:
    """Drives and judges the comparison, and the ablation where it is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--trials", type=int, default=32, help="of each named scenario")
    parser.add_argument("--worlds", type=int, default=32)
    parser.add_argument(
        "--scenarios",
        default=",".join([*PUBLISHED_SCENARIOS, "everyday"]),
        help="the named ones, comma-separated",
    )
    parser.add_argument("--columns", help="drive these alone, comma-separated, and judge nothing")
    parser.add_argument("--ablation", action="store_true")
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    folder = arguments.folder / "worlds"
    folder.mkdir(parents=True, exist_ok=True)
    worlds = [write_world(folder, FIRST_WORLD + k) for k in range(arguments.worlds)]
    columns = [OURS, *(ABLATIONS.values() if arguments.ablation else RIVALS)]
    if arguments.columns:
        columns = arguments.columns.split(",")
    asked = rounds(arguments.scenarios.split(","), worlds, columns, arguments.trials)
    trials = judged(drive_missing(arguments.folder / "trials.csv", asked, arguments.jobs))
    if arguments.columns:
        return
    if arguments.ablation:
        names = {"all of it": OURS} | ABLATIONS
    else:
        print(markdown(comparison(trials)), "\n")
        names = {name: name for name in columns}
    print(markdown(means(trials, names).reset_index(names="column")))


if __name__ == "__main__":
    main()
