"""The study of docs/questions/casters.md: `python studies/questions.py casters FOLDER`."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from question_trials import Arm, Row, Study, arrived, robot_in, table

from drake_navbench.analysis.paired_comparison import compare_differences
from drake_navbench.analysis.pairs import confidence_of_each
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.logs.log import TrialLog

SCENARIO, IDEAL, CASTERS = "empty", "wheelchair", "wheelchair_casters"
# Swivel friction of each caster, N m.
FRICTIONS_NM = (0.5, 0.75, 1.0, 1.5, 2.0)
CONTROLLERS = {
    "rpp": "rpp",
    "rpp_far": "rpp:lookahead_dist=1.0",
    "dwb": "dwb",
    "mppi_nav2": "mppi_nav2",
    "mppi_bringup": "mppi_bringup",
    "mppi_narrow": "mppi_nav2:wz_std=0.2",
}
# Cruise: from so long after the start to so long before the end; what lasts, from later on.
CRUISE_FROM_S, LASTING_FROM_S, CRUISE_UNTIL_S = 3.0, 8.0, 2.0
# A spread of the yaw rate that is larger by this than on ideal wheels is a wobble, rad/s.
WOBBLE_RADPS = 0.01
MEASURES = ("yaw_rate_sd_radps", "lasting_sd_radps")


def arms() -> list[Arm]:
    """Returns every controller on ideal wheels and on casters of every friction."""
    scenario = load_scenario(SCENARIO)
    robots = {"ideal": scenario.load_robot(IDEAL)}
    for friction_nm in FRICTIONS_NM:
        casters = {"swivel_friction_nm": friction_nm, "start_angles_rad": [3.0, 3.0]}
        robots[f"{friction_nm:g}"] = robot_in(scenario, CASTERS, {"drive": {"casters": casters}})
    return [
        Arm(f"{name} {chair}", scenario, robot, column)
        for name, column in CONTROLLERS.items()
        for chair, robot in robots.items()
    ]


def kept_of(log: TrialLog) -> Row:
    """Returns the spread of the yaw rate in the cruise and in its later part, and the heading."""
    samples = log.samples
    time_s, w = samples["time_s"].to_numpy(), samples["w_radps"].to_numpy()
    before_end = time_s < log.end_time_s - CRUISE_UNTIL_S
    return {
        "yaw_rate_sd_radps": _spread(w[before_end & (time_s > CRUISE_FROM_S)]),
        "lasting_sd_radps": _spread(w[before_end & (time_s > LASTING_FROM_S)]),
        "heading_max_deg": float(np.degrees(samples["yaw_rad"].abs().max())),
    }


def _spread(values: np.ndarray) -> float:
    return float(values.std()) if len(values) else float("nan")


def tell(rows: pd.DataFrame) -> Mapping[str, str]:
    """Returns the tables of the page: one a measure, and from which friction on each wobbles."""
    told = {}
    for measure in MEASURES:
        lines = []
        for controller in CONTROLLERS:
            ideal = _values(rows, f"{controller} ideal", measure)
            lines.append(
                [f"`{controller}`", f"{ideal.mean():.4f}"]
                + [difference_cell(rows, controller, f, measure)[0] for f in FRICTIONS_NM]
            )
        heads = ["controller", "ideal wheels", *(f"{f:g} N m" for f in FRICTIONS_NM)]
        told[measure] = table(heads, lines)
    told["thresholds"] = _thresholds(rows)
    ends = rows[~arrived(rows)]
    told["ends"] = f"{len(rows) - len(ends)} of {len(rows)} trials arrived."
    return told


def difference_cell(
    rows: pd.DataFrame, controller: str, friction_nm: float, measure: str
) -> tuple[str, str]:
    """Returns the mean difference to ideal wheels with its interval, and what it shows.

    The interval is Student's over the seeds; those of one measure hold together at 95%. It shows
    "wobbles", "steady", or "open" where neither.
    """
    tests = len(CONTROLLERS) * len(FRICTIONS_NM)
    by_pair = _values(rows, f"{controller} {friction_nm:g}", measure) - _values(
        rows, f"{controller} ideal", measure
    )
    found = compare_differences(by_pair, confidence=confidence_of_each(tests))
    low, high = found.interval
    shown = "open"
    if low > WOBBLE_RADPS:
        shown = "wobbles"
    elif high < WOBBLE_RADPS:
        shown = "steady"
    text = f"{found.difference:+.4f} ({low:.4f} to {high:.4f})"
    return f"**{text}**" if shown == "wobbles" else text, shown


def _values(rows: pd.DataFrame, arm: str, measure: str) -> np.ndarray:
    own = rows[rows["arm"] == arm].sort_values("seed")
    return own[measure].to_numpy(dtype=float)


def _thresholds(rows: pd.DataFrame) -> str:
    lines = []
    for controller in CONTROLLERS:
        cells = [f"`{controller}`"]
        for measure in MEASURES:
            shown = [difference_cell(rows, controller, f, measure)[1] for f in FRICTIONS_NM]
            steady = [f for f, word in zip(FRICTIONS_NM, shown, strict=True) if word == "steady"]
            wobbly = [f for f, word in zip(FRICTIONS_NM, shown, strict=True) if word == "wobbles"]
            cells += [
                ", ".join(f"{f:g}" for f in steady) or "none",
                ", ".join(f"{f:g}" for f in wobbly) or "none",
            ]
        lines.append(cells)
    heads = ["controller", "steady at [N m]", "wobbles at [N m]"]
    return table([*heads, "later: steady at", "later: wobbles at"], lines)


def draw(rows: pd.DataFrame) -> Figure:
    """Returns the spread of the yaw rate over the friction, a panel a measure."""
    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    titles = ("from 3 s on", "from 8 s on")
    for panel, measure, title in zip(figure.subplots(1, 2), MEASURES, titles, strict=True):
        for place, controller in enumerate(CONTROLLERS):
            means = [_values(rows, f"{controller} {f:g}", measure).mean() for f in FRICTIONS_NM]
            ideal = _values(rows, f"{controller} ideal", measure).mean()
            panel.plot(
                [0.0, *FRICTIONS_NM], [ideal, *means], "o-", color=f"C{place}", label=controller
            )
        panel.set(title=title, xlabel="swivel friction [N m]; 0: ideal wheels")
    figure.axes[0].set_ylabel("spread of the yaw rate [rad/s]")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=6)
    return figure


STUDY = Study("casters", arms(), range(8), kept_of, tell, draw)
