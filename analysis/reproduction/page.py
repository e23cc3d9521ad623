"""reproduction.html: the publication and our trials side by side on one static page."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from drake_navbench.analysis.html import page_environment, relative_change
from drake_navbench.analysis.pairs import RELEVANT_RATIO
from drake_navbench.analysis.reproduction.concordance import EXCLUDED_METRICS, PUBLISHED_TRIALS
from drake_navbench.analysis.reproduction.heading_ties import heading_ties
from drake_navbench.analysis.reproduction.judgement import Estimate, FindingVerdict, Judgement, Part
from drake_navbench.analysis.reproduction.lineup_results import (
    TOGETHER,
    LineupResult,
    Share,
    agreements,
    errors_by_metric,
    lineup_agreements,
    shares,
    shares_by_difficulty,
)
from drake_navbench.analysis.reproduction.lineups import (
    ALL_SCENARIOS,
    GOAL_SCENARIOS,
    LINEUPS,
    PUBLISHED_SETTINGS,
    Lineup,
)
from drake_navbench.analysis.reproduction.publication import PUBLISHED_CONTROLLERS
from drake_navbench.analysis.reproduction.published_cells import Comparison
from drake_navbench.errors import InputError
from drake_navbench.kernels.percent import PERCENT
from drake_navbench.logs.results import file_name
from drake_navbench.typed_files.dotted_names import flattened
from drake_navbench.typed_files.typed_yaml import read_yaml

COMMAND = "drake-navbench run"
SECONDS_PER_MINUTE = 60.0
# The page marks an ordering that holds with less than this share of the published difference.
SMALL_SHARE = 0.25


ParametersOf = Callable[[str], Mapping[str, Any] | None]
"""From the name of a preset to its resolved parameters, None where they are not known."""


def nothing_known(preset: str) -> None:
    """Returns None for every preset: no parameters are known."""


class Change(NamedTuple):
    """A parameter in which two presets differ; None where one does not have it."""

    parameter: str
    first: Any
    second: Any


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


def changed_parameters(
    folder: Path, first: str, second: str, parameters_of: ParametersOf = nothing_known
) -> list[Change] | None:
    """Returns the parameters in which two presets differ, None where one is not known.

    A driven preset is read from its resolved file beside the results, any other from parameters_of.
    Raises InputError where such a file cannot be read.
    """
    found = [_parameters(folder, preset, parameters_of) for preset in (first, second)]
    if None in found:
        return None
    fields = [dict(flattened(parameters)) for parameters in found if parameters is not None]
    names = sorted(set(fields[0]) | set(fields[1]))
    changes = [Change(name, fields[0].get(name), fields[1].get(name)) for name in names]
    return [change for change in changes if change.first != change.second]


def render(
    folder: Path,
    *,
    manifest: Mapping[str, Any],
    trials: pd.DataFrame,
    results: Sequence[LineupResult],
    parameters_of: ParametersOf = nothing_known,
) -> str:
    """Returns the page's HTML; parameters_of: as for `changed_parameters`."""
    environment = page_environment([*manifest.get("controllers", []), *trials["controller"]])
    environment.filters.update(
        number=_number, span=_span, duration=_duration, change=relative_change, percent=_percent,
        size=_size,
    )  # fmt: skip
    main, *others = results
    lineups = [lineup_result.lineup for lineup_result in results]
    noisy = next((a for a in others if a.lineup.scenarios), None)
    rows = agreements(main, noisy)
    page = {
        "folder": folder.resolve().name,
        "command": command_line(manifest["request"]) if "request" in manifest else "",
        "trials_per_cell": int(trials.groupby(["scenario", "controller"]).size().min()),
        "trial_count": len(trials),
        "driven_s": float(trials["duration_s"].sum()),
        "wall_clock_s": manifest.get("wall_clock_s"),
        "lineups": lineups,
        "drives_constrained_teb": any("teb" in lineup.presets.values() for lineup in lineups),
        "absent": [lineup for lineup in LINEUPS if lineup not in lineups],
        "shares": _share_rows(results),
        "total": shares(main.judgements)[-1],
        "difficulty": shares_by_difficulty(main.judgements),
        "errors": errors_by_metric(main),
        "baseline": main.baseline,
        "ties": heading_ties(trials, main.lineup, main.judgements),
        "agreements": rows,
        "together": rows[-1],
        "other_agreements": [(a.lineup, lineup_agreements(a)) for a in others],
        "ceiling_trials": PUBLISHED_TRIALS,
        "bar": RELEVANT_RATIO,
        "small_share": SMALL_SHARE,
        "small_count": sum(_is_small(judgement) for judgement in main.judgements),
        "ordering_count": sum(_is_ordering(judgement) for judgement in main.judgements),
        "findings": [
            (judgement, [(a.lineup, a.judgements[i]) for a in others if _is_own(a, judgement)])
            for i, judgement in enumerate(main.judgements)
        ],
        "scenarios": list(dict.fromkeys(j.finding.scenario for j in main.judgements)),
        "controllers": PUBLISHED_CONTROLLERS,
        "labels": [PUBLISHED_SETTINGS.presets[name] for name in PUBLISHED_CONTROLLERS],
        "goal_scenarios": GOAL_SCENARIOS,
        "all_scenarios": ALL_SCENARIOS,
        "excluded": EXCLUDED_METRICS,
        "comparison": _comparison_rows(results),
        "changes": _changes(folder, parameters_of),
    }
    return environment.get_template("reproduction.html").render(page=page, main=main.lineup)


def _share_rows(results: Sequence[LineupResult]) -> list[tuple[str, list[Share | None]]]:
    """Returns for each scenario its name and one share a lineup.

    The share is None where a lineup has the same scenario and presets as the published lineup.
    """
    main, *others = results
    rows: list[tuple[str, list[Share | None]]] = [
        (share.scenario, [share]) for share in shares(main.judgements)
    ]
    for other in others:
        for (scenario, row), share in zip(rows, shares(other.judgements), strict=True):
            differs = scenario == TOGETHER or any(
                other.lineup.differs(main.lineup, scenario, name) for name in PUBLISHED_CONTROLLERS
            )
            row.append(share if differs else None)
    return rows


def _is_own(own: LineupResult, judgement: Judgement) -> bool:
    """Whether a lineup replaces a preset or scenario of this finding by one of its own."""
    finding = judgement.finding
    return any(
        own.lineup.differs(PUBLISHED_SETTINGS, finding.scenario, name)
        for name in finding.relation.controllers
    )


def _is_ordering(judgement: Judgement) -> bool:
    return judgement.deciding is not None and judgement.deciding.is_ordering


def _is_small(judgement: Judgement) -> bool:
    """Whether an ordering holds, or is level, below SMALL_SHARE of the published difference."""
    part = judgement.deciding
    return (
        judgement.verdict in (FindingVerdict.HOLDS, FindingVerdict.LEVEL)
        and part is not None
        and part.is_ordering
        and abs(part.share_of_published) < SMALL_SHARE
    )


def _comparison_rows(
    results: Sequence[LineupResult],
) -> list[tuple[str, str, str, list[tuple[Comparison, list[tuple[str, Comparison]]]]]]:
    """Returns one row a published metric: scenario, metric, unit, and one cell a controller.

    A cell has the comparison of the published lineup, then those of other lineups with trials of
    their own, each under the name of its scenario or preset.
    """
    rows: dict[tuple[str, str, str], list[tuple[Comparison, list[tuple[str, Comparison]]]]] = {}
    main, *others = results
    for index, row in enumerate(main.cells):
        own = [
            (_driven_name(lineup_result.lineup, row), lineup_result.cells[index])
            for lineup_result in others
            if lineup_result.lineup.differs(PUBLISHED_SETTINGS, row.scenario, row.controller)
        ]
        rows.setdefault((row.scenario, row.metric, row.unit), []).append((row, own))
    return [(*key, cells) for key, cells in rows.items()]


def _driven_name(lineup: Lineup, row: Comparison) -> str:
    """Returns the scenario or preset that a lineup drives in place of the published settings."""
    scenario = lineup.scenario(row.scenario)
    return scenario if scenario != row.scenario else lineup.presets[row.controller]


def _changes(folder: Path, parameters_of: ParametersOf) -> list[tuple[str, str, list[Change]]]:
    """Returns (preset, other preset, differing parameters) for presets that replace another."""
    pairs = dict.fromkeys(
        (PUBLISHED_SETTINGS.presets[name], lineup.presets[name])
        for lineup in LINEUPS[1:]
        for name in PUBLISHED_CONTROLLERS
        if lineup.presets[name] != PUBLISHED_SETTINGS.presets[name]
    )
    compared = [
        (first, second, changed_parameters(folder, first, second, parameters_of))
        for first, second in pairs
    ]
    return [(first, second, changes) for first, second, changes in compared if changes is not None]


def _parameters(folder: Path, preset: str, parameters_of: ParametersOf) -> Mapping[str, Any] | None:
    path = _preset_path(folder, preset)
    if not path.is_file():
        return parameters_of(preset)
    parameters = read_yaml(path).get("parameters")
    if not isinstance(parameters, Mapping):
        raise InputError(f"{path}: parameters: got {parameters!r}, expected a mapping")
    return parameters


def _preset_path(folder: Path, preset: str) -> Path:
    """Returns the path of a preset's resolved parameters."""
    return folder / "inputs" / "controllers" / f"{file_name(preset)}.yaml"


def _number(value: float) -> str:
    """Returns a value with the publication's three decimals, a dash where it is undefined."""
    return f"{value:.3f}" if math.isfinite(value) else "–"


def _span(ours: Estimate) -> str:
    """Returns the interval as text, or 'n = 1' for one trial."""
    if math.isfinite(ours.interval.low):
        return f"[{ours.interval.low:.3f}, {ours.interval.high:.3f}]"
    return "n = 1" if ours.count == 1 else ""


def _percent(ratio: float) -> str:
    """Returns a share in per cent, with two significant digits."""
    if not math.isfinite(ratio):
        return "–"
    percent = PERCENT * ratio
    return f"{percent:.2g}%" if abs(percent) < 10.0 else f"{percent:.0f}%"


def _size(part: Part, value: float) -> str:
    """Returns a size of a part: a signed share of the larger mean, or a plain ratio."""
    if not math.isfinite(value):
        return "–"
    return relative_change(value) if part.is_ordering else f"{value:.3f}"


def _duration(seconds: float) -> str:
    if seconds < 2 * SECONDS_PER_MINUTE:
        return f"{seconds:.0f} s"
    return f"{seconds / SECONDS_PER_MINUTE:.0f} min"
