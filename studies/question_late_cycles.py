"""The study of docs/questions/late_cycles.md: `python studies/questions.py late_cycles FOLDER`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import pandas as pd
from matplotlib.figure import Figure
from question_trials import (
    Arm,
    Row,
    Study,
    arrived,
    compared_by_metrics,
    ends_cells,
    measures_of,
    robot_in,
    spread,
    table,
    touched,
)

from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.logs.log import TrialLog

SCENARIOS, ROBOT = ("doorway", "crossing"), "wheelchair"
# Nav2 refuses a model_dt shorter than the period; the horizon is 2.8 s at each rate.
COLUMNS = {
    10: "mppi_nav2:model_dt=0.1:time_steps=28",
    20: "mppi_nav2",
    30: "mppi_nav2",
}
TIMES_MS = (0, 160, 320)
# The time of a cycle goes by the number of samples.
FULL_BATCH, BATCHES, BATCH_RATE_HZ = 2000, (1000, 500), 20
# Nav2's bringup: a server waits so long for a valid command.
PATIENCE_S = 0.3
KEPT = ("time_to_goal_s", "min_clearance_m", "angular_jerk_rms_radps3")


class Cell(NamedTuple):
    """A rate, a time of its cycles and a number of samples, in a scenario."""

    scenario: str
    rate_hz: int
    time_ms: int
    batch: int = FULL_BATCH

    @property
    def arm(self) -> str:
        """The name of its arm."""
        return f"{self.scenario} {self.rate_hz} Hz {self.time_ms} ms {self.batch}"


def cells() -> list[Cell]:
    """Returns the cells that are driven."""
    return [
        cell
        for scenario in SCENARIOS
        for cell in (
            *(Cell(scenario, rate_hz, time_ms) for rate_hz in COLUMNS for time_ms in TIMES_MS),
            *(
                Cell(scenario, BATCH_RATE_HZ, time_ms * batch // FULL_BATCH, batch)
                for batch in BATCHES
                for time_ms in TIMES_MS[1:]
            ),
        )
    ]


def pairs() -> list[tuple[str, str]]:
    """Returns the arms that are compared: later cycles, higher rates, smaller batches."""
    found = []
    for scenario in SCENARIOS:
        for rate_hz in COLUMNS:
            in_time = Cell(scenario, rate_hz, 0)
            found += [(in_time, Cell(scenario, rate_hz, time_ms)) for time_ms in TIMES_MS[1:]]
        for lower, higher in ((10, 20), (20, 30)):
            found += [
                (Cell(scenario, lower, time_ms), Cell(scenario, higher, time_ms))
                for time_ms in TIMES_MS
            ]
        for time_ms in TIMES_MS[1:]:
            full = Cell(scenario, BATCH_RATE_HZ, time_ms)
            found += [
                (full, Cell(scenario, BATCH_RATE_HZ, time_ms * batch // FULL_BATCH, batch))
                for batch in BATCHES
            ]
    return [(before.arm, after.arm) for before, after in found]


def arms() -> list[Arm]:
    """Returns an arm for each cell."""
    scenarios = {name: load_scenario(name) for name in SCENARIOS}
    found = []
    for cell in cells():
        scenario = scenarios[cell.scenario]
        server = {"controller_frequency": float(cell.rate_hz), "failure_tolerance": PATIENCE_S}
        overrides = {
            "navigation": {"controller_server": server},
            "timing": {"compute_time": float(cell.time_ms)},
        }
        batch = "" if cell.batch == FULL_BATCH else f":batch_size={cell.batch}"
        robot = robot_in(scenario, ROBOT, overrides)
        found.append(Arm(cell.arm, scenario, robot, COLUMNS[cell.rate_hz] + batch))
    return found


def kept_of(log: TrialLog) -> Row:
    """Returns the metrics of a trial that the page tells."""
    return measures_of(log, KEPT)


def tell(rows: pd.DataFrame) -> Mapping[str, str]:
    """Returns the tables of the page."""
    lines = []
    for cell in cells():
        own = rows[rows["arm"] == cell.arm]
        reached = own[arrived(own)]
        lines.append(
            [
                f"`{cell.scenario}`",
                f"{cell.rate_hz}",
                f"{cell.time_ms}",
                f"{cell.batch}",
                *ends_cells(own, tests=len(cells())),
                spread(reached, "time_to_goal_s", "{:.1f}"),
                spread(reached, "min_clearance_m", "{:.2f}"),
            ]
        )
    titles = [
        *("scenario", "rate [Hz]", "cycle takes [ms]", "samples", "touches", "arrivals"),
        *("time to the goal [s]", "least clearance [m]"),
    ]
    return {"arms": table(titles, lines)} | compared_by_metrics(rows, pairs(), KEPT)


def draw(rows: pd.DataFrame) -> Figure:
    """Returns arrivals and touches over the time of a cycle, a panel a scenario."""
    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    panels = figure.subplots(1, len(SCENARIOS), sharey=True)
    for panel, scenario in zip(panels, SCENARIOS, strict=True):
        series = [(f"{rate} Hz", rate, FULL_BATCH) for rate in COLUMNS]
        series += [
            (f"{BATCH_RATE_HZ} Hz, {batch} samples", BATCH_RATE_HZ, batch) for batch in BATCHES
        ]
        for place, (label, rate_hz, batch) in enumerate(series):
            own = [
                c for c in cells() if (c.scenario, c.rate_hz, c.batch) == (scenario, rate_hz, batch)
            ]
            # A smaller batch stands where the computer needs so long for the full one.
            times = [cell.time_ms * FULL_BATCH // cell.batch for cell in own]
            shares = [
                [100 * f(rows[rows["arm"] == c.arm]).mean() for c in own]
                for f in (arrived, touched)
            ]
            panel.plot(times, shares[0], "o-", color=f"C{place}", label=label)
            panel.plot(times, shares[1], "x--", color=f"C{place}")
        panel.set(title=scenario, xlabel="2000 samples take [ms]")
    panels[0].set_ylabel("arrivals (o), touches (x) [%]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure


STUDY = Study("late_cycles", arms(), range(10), kept_of, tell, draw)
