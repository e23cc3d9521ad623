"""The reproduction of the publication: findings judged, numbers side by side, one page.

`write_reproduction` needs a results folder and nothing else; it never simulates.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from drake_navbench.analysis.reproduction.concordance import concordance, is_covered
from drake_navbench.analysis.reproduction.findings import findings
from drake_navbench.analysis.reproduction.judgement import Judgement, Part
from drake_navbench.analysis.reproduction.lineup_results import LineupResult, lineup_result, shares
from drake_navbench.analysis.reproduction.lineups import present_lineups
from drake_navbench.analysis.reproduction.page import ParametersOf, nothing_known, render
from drake_navbench.analysis.reproduction.publication import PUBLISHED_CONTROLLERS, published_table
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.logs.text_tables import csv_text
from drake_navbench.typed_files.output_file import write_text

PAGE_NAME = "reproduction.html"
FINDINGS_NAME = "findings.csv"
COMPARISON_NAME = "published_vs_ours.csv"
ORDERINGS_NAME = "orderings.csv"


def has_published_scenarios(scenarios: Iterable[str]) -> bool:
    """Whether one of the scenarios is a published one."""
    return not set(published_table()["scenario"]).isdisjoint(scenarios)


class Reproduction(NamedTuple):
    """The path of the written page, and its result in a sentence."""

    path: Path
    sentence: str


def write_reproduction(
    folder: Path, trials: pd.DataFrame | None = None, parameters_of: ParametersOf = nothing_known
) -> Reproduction:
    """Writes findings.csv, published_vs_ours.csv, orderings.csv in tables/, and reproduction.html.

    trials: rows as from `trial_row`; the folder's own table if not given. Manifest and inputs are
    the folder's. parameters_of: returns the resolved parameters of a preset that was not driven, or
    None; then the page does not list the preset's changes. Raises InputError where the folder is no
    results folder.
    """
    results_folder = ResultsFolder(folder)
    manifest = results_folder.read_manifest()
    if trials is None:
        trials = pd.read_parquet(results_folder.trials_path)
    results = [lineup_result(trials, lineup) for lineup in present_lineups(trials)]
    tables = folder / "tables"
    write_text(tables / FINDINGS_NAME, csv_text(findings_table(results)))
    write_text(tables / COMPARISON_NAME, csv_text(comparison_table(results)))
    write_text(tables / ORDERINGS_NAME, csv_text(orderings_table(results)))
    page = folder / PAGE_NAME
    write_text(
        page,
        render(
            folder, manifest=manifest, trials=trials, results=results, parameters_of=parameters_of
        ),
    )
    return Reproduction(page, _in_a_sentence(results[0]))


def _in_a_sentence(own: LineupResult) -> str:
    total = shares(own.judgements)[-1]
    found = concordance(own.orderings)
    if total.undecided == total.total:
        text = f"So few trials decide none of the publication's {total.total} claims"
    else:
        text = f"Of the publication's {total.total} claims {total.holds} hold here"
        if total.holds_from_one_trial:
            count = total.holds_from_one_trial
            text += f" ({count} of them by one trial, as nothing there is random)"
        text += f", {total.level} are level, {total.contradicted} do not hold and "
        text += f"{total.undecided} are undecided"
    if not found.orderings:
        return f"{text}."
    text += f". {found.ratio:.0%} of the orderings of two controllers in its tables are found again"
    if not own.baseline.permutations:
        return f"{text}."
    return (
        f"{text}; with the controllers' names exchanged it is {own.baseline.median:.0%} in the "
        f"median of all exchanges, and {own.baseline.best:.0%} in the best one."
    )


def findings_table(results: Iterable[LineupResult]) -> pd.DataFrame:
    """Returns one row a finding and lineup: published values, ours with intervals, verdict."""
    return pd.DataFrame(
        [
            _finding_row(lineup_result.lineup.name, judgement)
            for lineup_result in results
            for judgement in lineup_result.judgements
        ]
    )


def comparison_table(results: Iterable[LineupResult]) -> pd.DataFrame:
    """Returns one row a published number and lineup: ours, its interval, relative difference."""
    return pd.DataFrame(
        [
            {
                "scenario": row.scenario,
                "metric": row.metric,
                "unit": row.unit,
                "controller": row.controller,
                "lineup": lineup_result.lineup.name,
                "driven_scenario": lineup_result.lineup.scenario(row.scenario),
                "preset": lineup_result.lineup.presets[row.controller],
                "published": row.published,
                "ours": row.ours.mean,
                "ours_low": row.ours.interval.low,
                "ours_high": row.ours.interval.high,
                "relative_difference": row.relative_difference,
                "trials": row.ours.count,
            }
            for lineup_result in results
            for row in lineup_result.cells
        ]
    )


def orderings_table(results: Iterable[LineupResult]) -> pd.DataFrame:
    """Returns one row a published ordering and lineup: both differences, whether they agree.

    A difference is the second's mean minus the first's, as a share of the larger mean.
    """
    claimed = findings()
    return pd.DataFrame(
        [
            {
                "lineup": lineup_result.lineup.name,
                **row._asdict(),
                "agreement": row.agreement,
                "is_claimed": is_covered(row, claimed),
            }
            for lineup_result in results
            for row in lineup_result.orderings
        ]
    )


def _finding_row(lineup: str, judgement: Judgement) -> dict[str, Any]:
    finding = judgement.finding
    deciding = judgement.deciding or Part("", judgement.verdict)
    row: dict[str, Any] = {
        "id": finding.number,
        "lineup": lineup,
        "scenario": finding.scenario,
        "metric": finding.metric,
        "relation": finding.relation_text,
        "controllers": finding.controllers_text,
        "where": finding.where,
        "verdict": str(judgement.verdict),
        "trials": deciding.difference.count,
        "deciding": deciding.text,
        "size": deciding.size,
        "published_size": deciding.published_size,
        "share_of_published": deciding.share_of_published,
        "difference": deciding.difference.mean,
        "difference_low": deciding.difference.interval.low,
        "difference_high": deciding.difference.interval.high,
        "note": judgement.note,
    }
    for name in PUBLISHED_CONTROLLERS:
        ours = judgement.ours[name]
        row[f"{name}_published"] = finding.published[name]
        row[f"{name}_mean"] = ours.mean
        row[f"{name}_low"], row[f"{name}_high"] = ours.interval
    return row
