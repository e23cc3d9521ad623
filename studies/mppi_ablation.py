"""The gain of MPPI by the polish: `python studies/mppi_ablation.py` writes docs/mppi_ablation.md.

Drives `mppi_nav2` (the sampler alone) and `mppi` (with the polish) through the first three
published scenarios. Both meet the same noise in a trial, so the differences are paired by seed.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from drake_navbench import run_benchmark
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.paired_comparison import paired_comparison
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS

SAMPLED, POLISHED = "mppi_nav2", "mppi"
SCENARIOS = PUBLISHED_SCENARIOS[:3]
TRIAL_COUNT = 8
METRICS = (
    "jerk_rms_mps3",
    "angular_jerk_rms_radps3",
    "cross_track_error_rms_m",
    "min_clearance_m",
    "time_to_goal_s",
)
PAGE = Path(__file__).parents[1] / "docs" / "mppi_ablation.md"
SIGNIFICANT_DIGITS = 3

HEADER = """\
# What the polish adds to MPPI

Made by `python studies/mppi_ablation.py`. `mppi_nav2` is Nav2's sampler alone, `mppi` the same
sampler with the nonlinear program behind it. {trials} trials each in {scenarios}, paired by seed:
both controllers meet the same noise. A difference is `mppi` minus `mppi_nav2`, with Student's 95%
interval of the mean of the paired differences; p is Wilcoxon's signed-rank test. Bold: the interval
leaves zero out.
"""
TABLE_HEAD = """\
| metric | unit | better | mppi_nav2 | mppi | difference | 95% interval | p | pairs |
|---|---|---|---:|---:|---:|---:|---:|---:|"""


def ablation_page(trials: pd.DataFrame) -> str:
    """Returns the page in Markdown.

    trials: rows as `run_benchmark` returns them, of both controllers.
    """
    counts = trials.groupby(["scenario", "controller"])["seed"].count()
    scenarios = list(dict.fromkeys(trials["scenario"]))
    lines = [HEADER.format(trials=counts.max(), scenarios=_sentence_list(scenarios))]
    for scenario in scenarios:
        own = trials[trials["scenario"] == scenario].set_index("seed")
        sampled = own[own["controller"] == SAMPLED]
        polished = own[own["controller"] == POLISHED]
        lines += [f"## {scenario}", "", f"{_outcomes(sampled)}; {_outcomes(polished)}.", ""]
        lines += [TABLE_HEAD, *(_row(name, sampled[name], polished[name]) for name in METRICS), ""]
    return "\n".join(lines)


def _row(name: str, sampled: pd.Series, polished: pd.Series) -> str:
    metric = next(entry for entry in all_metrics() if entry.name == name)
    compared = paired_comparison(sampled, polished)
    low, high = (_number(value) for value in compared.interval)
    difference = _number(compared.difference)
    if compared.interval.excludes(0.0):
        difference = f"**{difference}**"
    cells = [
        name,
        metric.unit,
        str(metric.better),
        _number(sampled.mean()),
        _number(polished.mean()),
        difference,
        f"{low} to {high}",
        _number(compared.p_value),
        str(compared.pairs),
    ]
    return f"| {' | '.join(cells)} |"


def _outcomes(trials: pd.DataFrame) -> str:
    counts = trials["outcome"].value_counts()
    listed = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
    return f"{trials['controller'].iloc[0]}: {listed}"


def _number(value: float) -> str:
    return "–" if pd.isna(value) else f"{value:.{SIGNIFICANT_DIGITS}g}"


def _sentence_list(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def main() -> None:
    """Runs the trials and writes the page."""
    results = run_benchmark(SCENARIOS, (SAMPLED, POLISHED), trials=TRIAL_COUNT)
    PAGE.write_text(ablation_page(results.trials), encoding="utf-8")


if __name__ == "__main__":
    main()
