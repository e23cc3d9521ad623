"""Trials that nobody drives: their metrics are a formula of what a search may vary.

Of it the truth is known, so that a search can be asked to find it again.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from drake_navbench.analysis.published import PUBLISHED_METRICS
from drake_navbench.identification.targets import Cell

TRUE_GOAL_M, TRUE_LAG_S = 7.44, 0.22
TRUE_LOOKAHEAD_M = 0.85
TRUE_SIM_TIME_S = 1.2
WALL_M = 4.7

UNKNOWNS = """
base:
  drive.response_time_constant_s: "0.02:0.4"
layouts:
  empty: {goal_m: "7.3:7.7"}
controllers:
  rpp:
    preset: rpp
    blind: rpp_bringup
    parameters: {lookahead_dist: "0.3:1.2", desired_linear_vel: "0.3:0.5"}
  dwb:
    preset: dwb
    blind: dwb_bringup
    parameters: {sim_time: "0.8:2.5"}
"""


def formula(
    scenario: str, controller: str, *, goal_m: float, lag_s: float, own: float
) -> dict[str, float]:
    """Returns metrics of a trial; own: RPP's lookahead, DWB's horizon."""
    reach_m = goal_m if scenario == "empty" else WALL_M
    share = 0.1 if controller == "rpp" else 0.2
    return {
        "path_length": reach_m,
        "time_taken": 2.0 * reach_m + 5.0 * lag_s,
        "rms_linear_jerk": share / (0.1 + lag_s),
        "avg_path_error": share * own,
        "avg_heading_error": 3.0 * share * own**2,
        "energy": 0.5 * reach_m + share * own,
    }


def drive_each(specs, kept_of, *, jobs):
    """What `tuning.pairs.drive_each` returns of planted trials."""
    rows = []
    for spec in specs:
        parameters = spec.preset.parameters
        is_rpp = spec.preset.controller == "rpp"
        metrics: dict[str, Any] = {entry.name: float("nan") for entry in PUBLISHED_METRICS}
        metrics |= formula(
            spec.scenario.name,
            "rpp" if is_rpp else "dwb",
            goal_m=spec.scenario.goal[0],
            lag_s=spec.robot.drive.response_time_constant_s,
            own=parameters.lookahead_dist if is_rpp else parameters.sim_time,
        )
        rows.append(metrics)
    return rows


def true_cells() -> dict[Cell, float]:
    """Returns the planted tables."""
    own = {"rpp": TRUE_LOOKAHEAD_M, "dwb": TRUE_SIM_TIME_S}
    return {
        Cell(scenario, metric, controller): value
        for scenario in ("empty", "restricted_large")
        for controller in own
        for metric, value in formula(
            scenario, controller, goal_m=TRUE_GOAL_M, lag_s=TRUE_LAG_S, own=own[controller]
        ).items()
    }


def write_problem(folder: Path) -> tuple[Path, Path]:
    """Writes the planted tables and the list of unknowns; returns their paths."""
    cells = true_cells()
    lines = ["scenario,metric,unit,rpp,dwb"]
    for scenario, metric in dict.fromkeys(cell[:2] for cell in cells):
        numbers = [f"{cells[Cell(scenario, metric, name)]:.4f}" for name in ("rpp", "dwb")]
        lines.append(",".join([scenario, metric, "m", *numbers]))
    tables, unknowns = folder / "tables.csv", folder / "unknowns.yaml"
    tables.write_text("\n".join(lines) + "\n", encoding="utf-8")
    unknowns.write_text(UNKNOWNS, encoding="utf-8")
    return tables, unknowns
