"""Design, trials and judgement of the studies in docs/questions: the part that they share.

A study is a few arms, driven over the same seeds, so that its trials are paired. `questions.py` is
its command.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from drake_navbench.analysis.figures.style import SVG, figure_style, write_figure
from drake_navbench.analysis.metrics.definition import Better, Metric
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.paired_tests import Family, Finding, Judged, PairedVerdict, judge_pairs
from drake_navbench.analysis.paired_trials import Contest
from drake_navbench.analysis.pairs import confidence_of_each
from drake_navbench.analysis.statistics import exact_share_interval
from drake_navbench.campaign.rows_of_trials import drive_each
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import Robot, overridden
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.text_tables import markdown_table
from drake_navbench.trial.spec import TrialSpec

PAGES = Path(__file__).parents[1] / "docs" / "questions"
# Seeds from here on are for trying things out; no page counts them.
FIRST_TRY_OUT_SEED = 100_000
# A page with so many units can still be driven by whoever wants to repeat it.
AFFORDABLE_UNITS = 64
# Numbers in the rows have so many digits.
ROUNDED = "%.6g"
# Verdicts that decide nothing.
OPEN = (PairedVerdict.UNDECIDED, PairedVerdict.EQUAL, PairedVerdict.NO_VALUE)

# The titles of outcomes and of metrics of the benchmark in the tables.
TITLES = {
    "touch_rate": "touches [%]",
    "success_rate": "arrivals [%]",
    "time_to_goal_s": "time to the goal [s]",
    "min_clearance_m": "least clearance [m]",
    "cross_track_error_rms_m": "off the path, r.m.s. [m]",
    "angular_jerk_rms_radps3": "angular jerk, r.m.s. [rad/s³]",
}

Row = dict[str, Any]


class Arm(NamedTuple):
    """One of the things that are compared: a robot in a scenario and the column that drives it."""

    name: str
    scenario: Scenario
    robot: Robot
    column: str

    def spec(self, seed: int) -> TrialSpec:
        """Returns the trial of a seed; raises InputError."""
        preset = load_preset(self.column).for_robot(self.robot)
        return TrialSpec(self.scenario, self.robot, preset, seed=seed, keeps_costmaps=False)


def robot_in(scenario: Scenario, robot: str, overrides: Mapping[str, Any]) -> Robot:
    """Returns a robot as it is in a scenario, with fields replaced; raises InputError."""
    return overridden(scenario.load_robot(robot), overrides, "study")


class Study(NamedTuple):
    """The arms, units and measures of a page, and the way it tells them.

    name: of the page. seeds: a unit each. kept_of: from a log to what is kept of it, beside arm,
    seed, outcome and time. tell: from the rows to Markdown by the name of its place on the page.
    """

    name: str
    arms: Sequence[Arm]
    seeds: Sequence[int]
    kept_of: Callable[[TrialLog], Row]
    tell: Callable[[pd.DataFrame], Mapping[str, str]]
    draw: Callable[[pd.DataFrame], Figure]


class Kept(NamedTuple):
    """`kept_of` with what is kept of every trial; can be sent to a worker."""

    of_study: Callable[[TrialLog], Row]

    def __call__(self, log: TrialLog) -> Row:
        """Returns the row of a trial, without its arm."""
        common = {
            "seed": log.info["seed"],
            "outcome": str(log.outcome),
            "simulated_time_s": log.end_time_s,
        }
        return common | self.of_study(log)


def drive_missing(study: Study, path: Path, *, jobs: int) -> None:
    """Drives the trials that a file of rows lacks, seed by seed; writes each when it is over.

    A command that is stopped loses no trial, and all seeds but the last one have every arm.
    """
    kept = read_rows(path) if path.exists() else pd.DataFrame({"arm": [], "seed": []})
    known = set(zip(kept["arm"], kept["seed"], strict=True))
    missing = [
        (arm, seed) for seed in study.seeds for arm in study.arms if (arm.name, seed) not in known
    ]
    specs = [arm.spec(seed) for arm, seed in missing]
    arm_of = {id(spec): arm.name for spec, (arm, _) in zip(specs, missing, strict=True)}
    new: list[Row] = []

    def write(spec: TrialSpec, row: Row) -> None:
        new.append({"arm": arm_of[id(spec)]} | row)
        rows = pd.DataFrame(new)
        partial = path.with_suffix(".partial")
        rows = rows if kept.empty else pd.concat([kept, rows], ignore_index=True)
        rows.to_csv(partial, index=False, float_format=ROUNDED)
        partial.replace(path)
        print(f"{len(kept) + len(new)} of {len(kept) + len(specs)} trials", flush=True)

    if specs:
        drive_each(specs, Kept(study.kept_of), jobs=jobs, on_row=write)


def read_rows(path: Path) -> pd.DataFrame:
    """Returns the rows of a file, one a trial."""
    return pd.read_csv(path)


def equal_rows(rows: pd.DataFrame, shipped: pd.DataFrame) -> int:
    """Returns the number of rows of trials that are equal to those of the same arm and seed."""
    ours, theirs = (own.set_index(["arm", "seed"]).sort_index() for own in (rows, shipped))
    common = ours.index.intersection(theirs.index)
    ours, theirs = ours.loc[common], theirs.reindex(columns=ours.columns).loc[common]
    same = (ours == theirs) | (ours.isna() & theirs.isna())
    return int(same.all(axis=1).sum())


def share_cell(count: int, of: int, *, tests: int = 1) -> str:
    """Returns a cell such as "5 of 16 (11 to 59%)"; so many intervals hold together at 95%."""
    low, high = exact_share_interval(count, of, confidence=confidence_of_each(tests))
    return f"{count} of {of} ({100 * low:.0f} to {100 * high:.0f}%)"


def spread(rows: pd.DataFrame, column: str, form: str, factor: float = 1.0) -> str:
    """Returns median and range of a column, such as "1.2 (0.8 to 3.0)"."""
    values = factor * rows[column].dropna().to_numpy(dtype=float)
    if not len(values):
        return "–"
    middle, low, high = (form.format(f(values)) for f in (np.median, np.min, np.max))
    return f"{middle} ({low} to {high})"


def measures_of(log: TrialLog, names: Iterable[str]) -> Row:
    """Returns metrics of a trial by name, NaN where it has no value."""
    known = {found.name: found for found in all_metrics()}
    return {name: known[name].measure(log).value for name in names}


def metric(name: str, unit: str, relevant: float = 0.0) -> Metric:
    """Returns a column of the rows as a metric: less is better."""
    return Metric(name, unit, Better.LOWER, lambda log: float("nan"), relevant=relevant)


def contest(rows: pd.DataFrame, before: str, after: str) -> Contest:
    """Returns the contest of two arms, paired by seed; its label names both."""
    sides = [
        rows[rows["arm"] == name].assign(scenario="", controller="") for name in (before, after)
    ]
    return Contest(*sides, f"{before} -> {after}")


def judged(
    rows: pd.DataFrame, pairs: Iterable[tuple[str, str]], metrics: Sequence[Metric]
) -> Judged:
    """Returns all pairs of arms, corrected together as `compare` does."""
    contests = [contest(rows, before, after) for before, after in pairs]
    return judge_pairs(contests, listed=[m.name for m in metrics], metrics=metrics)


def compared(
    rows: pd.DataFrame,
    pairs: Iterable[tuple[str, str]],
    metrics: Sequence[Metric],
    titles: Mapping[str, str],
) -> dict[str, str]:
    """Returns the page's tables of all pairs: what is decided, and what more units would decide.

    titles: by the name of the quantity; others are left out.
    """
    found = judged(rows, pairs, metrics).findings
    return {
        "pairs": findings_table(found, titles),
        "more": more_trials_table(found, titles),
    }


def compared_by_metrics(
    rows: pd.DataFrame, pairs: Iterable[tuple[str, str]], names: Sequence[str]
) -> dict[str, str]:
    """Returns the tables of `compared` by touches, arrivals and metrics of the benchmark."""
    metrics = [known for known in all_metrics() if known.name in names]
    titles = {name: TITLES[name] for name in ("touch_rate", "success_rate", *names)}
    return compared(rows, pairs, metrics, titles)


def ends_cells(rows: pd.DataFrame, *, tests: int) -> list[str]:
    """Returns the cells of the touches and of the arrivals of an arm; see `share_cell`."""
    return [
        share_cell(int(ends(rows).sum()), len(rows), tests=tests) for ends in (touched, arrived)
    ]


def findings_table(findings: Iterable[Finding], titles: Mapping[str, str]) -> str:
    """Returns the decided findings in Markdown, and how many are not.

    titles: by the name of the quantity; others are left out.
    """
    shown = [found for found in findings if found.quantity.name in titles]
    lines = [_finding_cells(found, titles) for found in shown if found.verdict not in OPEN]
    counts = {verdict: sum(found.verdict is verdict for found in shown) for verdict in OPEN}
    rest = ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)
    heads = ["from -> to", "measure", "pairs", "before", "after", "difference", "p", "verdict"]
    return f"{table(heads, lines)}\n\nOf {len(shown)} comparisons the others: {rest or 'none'}."


def more_trials_table(findings: Iterable[Finding], titles: Mapping[str, str]) -> str:
    """Returns the undecided outcomes that affordably more units would decide, in Markdown.

    Each would be decided if the difference stays as large as it was found. Of the metrics it says
    how many would be.
    """
    undecided = [
        (units_needed(found), found)
        for found in findings
        if found.quantity.name in titles and found.verdict is PairedVerdict.UNDECIDED
    ]
    outcomes, others = (
        [pair for pair in undecided if (pair[1].quantity.family is Family.OUTCOMES) is is_outcome]
        for is_outcome in (True, False)
    )
    able = [pair for pair in outcomes if pair[0] <= AFFORDABLE_UNITS]
    lines = [
        [*_finding_cells(found, titles)[:6], f"{needed:.0f}"]
        for needed, found in sorted(able, key=lambda pair: pair[0])
    ]
    heads = ["from -> to", "measure", "pairs", "before", "after", "difference", "units needed"]
    count = sum(needed <= AFFORDABLE_UNITS for needed, _ in others)
    more = len(outcomes) - len(able)
    rest = f"{more or 'No'} other undecided outcomes need more than {AFFORDABLE_UNITS}. "
    rest += (
        f"Of {len(others)} undecided differences of metrics {count} would be "
        f"decided by at most so many"
    )
    fewest = min((needed for needed, _ in others), default=math.inf)
    rest += f", the first of them by {fewest:.0f}." if count else "."
    return f"{table(heads, lines)}\n\n{rest}"


def units_needed(found: Finding) -> float:
    """Returns the number of units that would decide a difference as it was found; inf if none."""
    needed = found.trials_needed
    # Either test needs at least `fewest_differing` pairs, all moved in one direction.
    return math.inf if needed is None else max(needed, found.fewest_differing)


def _finding_cells(found: Finding, titles: Mapping[str, str]) -> list[str]:
    low, high = found.comparison.interval
    return [
        f"`{found.label}`".replace(" -> ", "` -> `"),
        titles[found.quantity.name],
        str(found.comparison.pairs),
        f"{found.base_mean:.3g}",
        f"{found.head_mean:.3g}",
        f"{found.comparison.difference:+.3g} ({low:.3g} to {high:.3g})",
        f"{found.p_value:.2g}",
        str(found.verdict),
    ]


def table(titles: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Returns a table in Markdown."""
    return "\n".join(markdown_table(titles, rows))


def arrived(rows: pd.DataFrame) -> pd.Series:
    """Returns whether each trial reached its goal."""
    return rows["outcome"] == str(Outcome.SUCCEEDED)


def touched(rows: pd.DataFrame) -> pd.Series:
    """Returns whether each trial ended in contact."""
    return rows["outcome"] == str(Outcome.COLLIDED)


def answer(study: Study, arguments: argparse.Namespace) -> None:
    """Drives, judges and prints a study; arguments: of `questions.py`."""
    if arguments.try_out:
        first = FIRST_TRY_OUT_SEED
        study = study._replace(seeds=range(first, first + arguments.try_out))
    arguments.folder.mkdir(parents=True, exist_ok=True)
    path = arguments.folder / "trials.csv"
    drive_missing(study, path, jobs=arguments.jobs)
    rows = _asked(study, read_rows(path))
    require_no_errors(rows, path)
    told = study.tell(rows)
    for name, text in told.items():
        print(f"{name}\n\n{text}\n")
    shipped = PAGES / f"{study.name}.csv"
    if arguments.write:
        write_page(study.name, rows, told, study.draw)
    elif shipped.exists():
        equal = equal_rows(rows, read_rows(shipped))
        print(f"{equal} of {len(rows)} trials are equal to those of docs/questions/{shipped.name}")


def require_no_errors(rows: pd.DataFrame, path: Path) -> None:
    """Ends the command where a trial ended in an error: it is neither an arrival nor a failure."""
    errors = rows[rows["outcome"] == str(Outcome.ERROR)]
    if not errors.empty:
        row = int(errors.index[0]) + 2
        sys.exit(
            f"{path}, line {row}: {len(errors)} of {len(rows)} trials ended in an error, this one "
            "among them; nothing is judged. Mend the column, delete these lines, drive again"
        )


def _asked(study: Study, rows: pd.DataFrame) -> pd.DataFrame:
    """Returns the rows of the study's arms and seeds, in their order."""
    order = {arm.name: place for place, arm in enumerate(study.arms)}
    asked = rows[rows["arm"].isin(order) & rows["seed"].isin(study.seeds)]
    places = asked["arm"].map(order)
    return asked.assign(_place=places).sort_values(["seed", "_place"]).drop(columns="_place")


def write_page(
    name: str,
    rows: pd.DataFrame,
    told: Mapping[str, str],
    draw: Callable[[pd.DataFrame], Figure],
) -> None:
    """Writes a page's rows, its picture, and its tables into their places."""
    rows.to_csv(PAGES / f"{name}.csv", index=False, float_format=ROUNDED)
    with figure_style():
        write_figure(draw(rows), PAGES / name, [SVG])
    page = PAGES / f"{name}.md"
    page.write_text(filled(page.read_text(encoding="utf-8"), told), encoding="utf-8")


def filled(page: str, told: Mapping[str, str]) -> str:
    """Returns a page with its tables, each between `<!-- NAME -->` and `<!-- end of NAME -->`."""
    for name, text in told.items():
        begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
        if begin not in page or end not in page:
            raise ValueError(f"the page has no place {begin} ... {end}")
        place = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.DOTALL)
        page = place.sub(lambda _, new=f"{begin}\n{text}\n{end}": new, page)
    return page
