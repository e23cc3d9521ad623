"""The reproduction of the publication: findings judged, numbers side by side, one page.

`write_reproduction` needs a results folder and nothing else; it never simulates.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import yaml

from drake_navbench.analysis.findings import (
    ALL_SCENARIOS,
    GOAL_SCENARIOS,
    LINEUPS,
    PUBLISHED_SETTINGS,
    Estimate,
    Judgement,
    Lineup,
    Verdict,
    estimate,
    findings,
    judge,
    trial_values,
)
from drake_navbench.analysis.html import page_environment, relative_change
from drake_navbench.analysis.statistics import BOOTSTRAP_RESAMPLES
from drake_navbench.analysis.tables import (
    PUBLISHED_CONTROLLERS,
    STD_HEADING_ERROR,
    published_table,
)
from drake_navbench.inputs.presets import as_yaml, load_preset
from drake_navbench.results import ResultsFolder, file_name, write_text

PAGE_NAME = "reproduction.html"
FINDINGS_NAME = "findings.csv"
COMPARISON_NAME = "published_vs_ours.csv"
COMMAND = "python -m drake_navbench.run"
# With fewer trials a bootstrap interval is clearly too narrow; the page says so.
FEW_TRIALS = 8
SECONDS_PER_MINUTE = 60.0


class Comparison(NamedTuple):
    """A published number beside ours; the difference is relative, NaN where 0 was published."""

    scenario: str
    metric: str
    unit: str
    controller: str
    published: float
    ours: Estimate
    relative_difference: float


class Share(NamedTuple):
    """How many findings of a scenario came to which verdict."""

    scenario: str
    holds: int
    contradicted: int
    undecided: int

    @property
    def total(self) -> int:
        """All findings of the scenario."""
        return self.holds + self.contradicted + self.undecided


class Change(NamedTuple):
    """A parameter in which two presets differ; None where one does not have it."""

    parameter: str
    first: Any
    second: Any


def has_published_scenarios(scenarios: Iterable[str]) -> bool:
    """Whether any of the scenarios is a published one, so that there is something to compare."""
    return not set(published_table()["scenario"]).isdisjoint(scenarios)


def write_reproduction(folder: Path, trials: pd.DataFrame | None = None) -> Path:
    """Writes tables/findings.csv, tables/published_vs_ours.csv and reproduction.html.

    trials: rows as from `tables.trial_row`; the folder's own table if not given. Manifest and
    inputs are the folder's. Returns the page's path; raises InputError where the folder is no
    results folder.
    """
    results = ResultsFolder(folder)
    manifest = results.read_manifest()
    if trials is None:
        trials = pd.read_parquet(results.trials_path)
    lineups = present_lineups(trials)
    judged = {lineup.name: judge_all(trials, lineup) for lineup in lineups}
    compared = {lineup.name: compare_numbers(trials, lineup) for lineup in lineups}
    tables = folder / "tables"
    write_text(tables / FINDINGS_NAME, findings_table(judged).to_csv(index=False))
    write_text(tables / COMPARISON_NAME, comparison_table(compared).to_csv(index=False))
    page = folder / PAGE_NAME
    write_text(
        page,
        render(
            folder, manifest=manifest, trials=trials, lineups=lineups, judged=judged,
            compared=compared,
        ),
    )  # fmt: skip
    return page


def present_lineups(trials: pd.DataFrame) -> list[Lineup]:
    """Returns the published lineup and every other that was driven with a preset of its own."""
    driven = set(trials["controller"])
    standard = set(PUBLISHED_SETTINGS.presets.values())
    others = [
        lineup for lineup in LINEUPS[1:] if driven & (set(lineup.presets.values()) - standard)
    ]
    return [PUBLISHED_SETTINGS, *others]


def judge_all(trials: pd.DataFrame, lineup: Lineup = PUBLISHED_SETTINGS) -> list[Judgement]:
    """Judges all findings in their order."""
    return [judge(finding, trials, lineup) for finding in findings()]


def shares(judgements: Sequence[Judgement]) -> list[Share]:
    """Returns the count of verdicts per scenario, in the order of the findings, then of all."""
    scenarios = list(dict.fromkeys(j.finding.scenario for j in judgements))
    rows = [
        _share(name, [j for j in judgements if j.finding.scenario == name]) for name in scenarios
    ]
    return [*rows, _share("together", judgements)]


def compare_numbers(trials: pd.DataFrame, lineup: Lineup = PUBLISHED_SETTINGS) -> list[Comparison]:
    """Returns every published number beside ours, in the publication's order."""
    rows = []
    for row in published_table().to_dict("records"):
        for controller in PUBLISHED_CONTROLLERS:
            ours = _ours(trials, row["scenario"], row["metric"], controller, lineup)
            published = float(row[controller])
            relative = ours.mean / published - 1.0 if published != 0.0 else math.nan
            rows.append(
                Comparison(
                    row["scenario"],
                    row["metric"],
                    row["unit"],
                    controller,
                    published,
                    ours,
                    relative,
                )
            )
    return rows


def findings_table(judged: Mapping[str, Sequence[Judgement]]) -> pd.DataFrame:
    """Returns one row a finding and lineup: published values, ours with intervals, the verdict."""
    rows = []
    for lineup, judgements in judged.items():
        for judgement in judgements:
            finding = judgement.finding
            row: dict[str, Any] = {
                "id": finding.number,
                "lineup": lineup,
                "scenario": finding.scenario,
                "metric": finding.metric,
                "relation": finding.relation_text,
                "controllers": finding.controllers_text,
                "where": finding.where,
                "verdict": str(judgement.verdict),
                "trials": judgement.pairs,
                "deciding": judgement.deciding,
                "margin": judgement.margin.mean,
                "margin_low": judgement.margin.interval.low,
                "margin_high": judgement.margin.interval.high,
                "margin_unit": finding.relation.margin_unit or "as the metric",
                "note": judgement.note,
            }
            for name in PUBLISHED_CONTROLLERS:
                ours = judgement.ours[name]
                row[f"{name}_published"] = finding.published[name]
                row[f"{name}_mean"] = ours.mean
                row[f"{name}_low"], row[f"{name}_high"] = ours.interval
            rows.append(row)
    return pd.DataFrame(rows)


def comparison_table(compared: Mapping[str, Sequence[Comparison]]) -> pd.DataFrame:
    """Returns one row a published number and lineup: ours, its interval, relative difference."""
    presets = {lineup.name: lineup.presets for lineup in LINEUPS}
    return pd.DataFrame(
        [
            {
                "scenario": row.scenario,
                "metric": row.metric,
                "unit": row.unit,
                "controller": row.controller,
                "lineup": lineup,
                "preset": presets[lineup][row.controller],
                "published": row.published,
                "ours": row.ours.mean,
                "ours_low": row.ours.interval.low,
                "ours_high": row.ours.interval.high,
                "relative_difference": row.relative_difference,
                "trials": row.ours.count,
            }
            for lineup, rows in compared.items()
            for row in rows
        ]
    )


def command_line(request: Mapping[str, Any]) -> str:
    """Returns the command that repeats a run, from the request in its manifest."""
    words = [*request.get("scenarios", ())]
    if controllers := request.get("controllers"):
        words += ["--controllers", ",".join(controllers)]
    for path in request.get("parameter_files", ()):
        words += ["--params", path]
    for option in ("trials", "seed", "robot"):
        if option in request:
            words += [f"--{option}", str(request[option])]
    return f"{COMMAND} {shlex.join(words)}"


def changed_parameters(folder: Path, first: str, second: str) -> list[Change]:
    """Returns where two presets differ.

    Of a preset that was driven the resolved file beside the results counts, of another what is
    installed.
    """
    fields = [_flat(_parameters(folder, preset)) for preset in (first, second)]
    names = sorted(set(fields[0]) | set(fields[1]))
    changes = [Change(name, fields[0].get(name), fields[1].get(name)) for name in names]
    return [change for change in changes if change.first != change.second]


def render(
    folder: Path,
    *,
    manifest: Mapping[str, Any],
    trials: pd.DataFrame,
    lineups: Sequence[Lineup],
    judged: Mapping[str, Sequence[Judgement]],
    compared: Mapping[str, Sequence[Comparison]],
) -> str:
    """Returns the page's HTML."""
    environment = page_environment()
    environment.filters.update(
        number=_number, span=_span, duration=_duration, change=relative_change
    )
    main = judged[PUBLISHED_SETTINGS.name]
    page = {
        "folder": folder.resolve().name,
        "command": command_line(manifest["request"]) if "request" in manifest else "",
        "trials_per_cell": int(trials.groupby(["scenario", "controller"]).size().min()),
        "few_trials": FEW_TRIALS,
        "resamples": BOOTSTRAP_RESAMPLES,
        "trial_count": len(trials),
        "driven_s": float(trials["duration_s"].sum()),
        "wall_clock_s": manifest.get("wall_clock_s"),
        "lineups": lineups,
        "absent": [lineup for lineup in LINEUPS if lineup not in lineups],
        "shares": {name: shares(rows) for name, rows in judged.items()},
        "findings": [
            (main[i], [judged[lineup.name][i] for lineup in lineups[1:]]) for i in range(len(main))
        ],
        "scenarios": list(dict.fromkeys(j.finding.scenario for j in main)),
        "controllers": PUBLISHED_CONTROLLERS,
        "labels": [PUBLISHED_SETTINGS.presets[name] for name in PUBLISHED_CONTROLLERS],
        "goal_scenarios": GOAL_SCENARIOS,
        "all_scenarios": ALL_SCENARIOS,
        "comparison": _comparison_rows(compared, lineups),
        "changes": _changes(folder),
    }
    return environment.get_template("reproduction.html").render(page=page)


def _share(name: str, judgements: Sequence[Judgement]) -> Share:
    verdicts = [judgement.verdict for judgement in judgements]
    return Share(name, *(verdicts.count(verdict) for verdict in Verdict))


def _ours(
    trials: pd.DataFrame, scenario: str, metric: str, controller: str, lineup: Lineup
) -> Estimate:
    """Returns our estimate of a published number; the spread over trials has no interval."""
    if metric != STD_HEADING_ERROR:
        return estimate(trial_values(trials, scenario, metric, lineup)[controller])
    values = trial_values(trials, scenario, "avg_heading_error", lineup)[controller].dropna()
    return Estimate(float(values.std(ddof=0)), count=len(values))


def _comparison_rows(
    compared: Mapping[str, Sequence[Comparison]], lineups: Sequence[Lineup]
) -> list[tuple[str, str, str, list[tuple[Comparison, list[Comparison]]]]]:
    """Returns a row a published metric: scenario, metric, unit, and a cell a controller.

    A cell holds the comparison of the published lineup, then those of the others.
    """
    rows: dict[tuple[str, str, str], list[tuple[Comparison, list[Comparison]]]] = {}
    main = compared[PUBLISHED_SETTINGS.name]
    for index, row in enumerate(main):
        cell = (row, [compared[lineup.name][index] for lineup in lineups[1:]])
        rows.setdefault((row.scenario, row.metric, row.unit), []).append(cell)
    return [(*key, cells) for key, cells in rows.items()]


def _changes(folder: Path) -> list[tuple[str, str, list[Change]]]:
    """Returns (preset, other preset, parameters that differ) for all that stand in for another."""
    pairs = dict.fromkeys(
        (PUBLISHED_SETTINGS.presets[name], lineup.presets[name])
        for lineup in LINEUPS[1:]
        for name in PUBLISHED_CONTROLLERS
        if lineup.presets[name] != PUBLISHED_SETTINGS.presets[name]
    )
    return [(first, second, changed_parameters(folder, first, second)) for first, second in pairs]


def _parameters(folder: Path, preset: str) -> Mapping[str, Any]:
    path = _preset_path(folder, preset)
    text = path.read_text(encoding="utf-8") if path.is_file() else as_yaml(load_preset(preset))
    return yaml.safe_load(text)["parameters"]


def _preset_path(folder: Path, preset: str) -> Path:
    """Returns where the resolved parameters of a preset are."""
    return folder / "inputs" / "controllers" / f"{file_name(preset)}.yaml"


def _flat(fields: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Returns nested parameters under dotted names."""
    flat: dict[str, Any] = {}
    for name, value in fields.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{name}.")
        else:
            flat[f"{prefix}{name}"] = value
    return flat


def _number(value: float) -> str:
    """Returns a value with the publication's three decimals, a dash where it is undefined."""
    return f"{value:.3f}" if math.isfinite(value) else "–"


def _span(ours: Estimate) -> str:
    low, high = ours.interval
    return f"[{low:.3f}, {high:.3f}]" if math.isfinite(low) else ""


def _duration(seconds: float) -> str:
    if seconds < 2 * SECONDS_PER_MINUTE:
        return f"{seconds:.0f} s"
    return f"{seconds / SECONDS_PER_MINUTE:.0f} min"
