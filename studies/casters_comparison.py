"""The tables of docs/casters.md.

Called as `python studies/casters_comparison.py [manoeuvres] [wobble] [scenarios]`.

Prints them in Markdown; all trials are driven one after the other in this process.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import Robot, load_robot, overridden
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.logs.log import Outcome, TrialLog
from drake_navbench.trial.open_loop import drive_open_loop
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate

IDEAL, PLANAR, MULTIBODY = "wheelchair", "wheelchair_casters", "wheelchair_multibody"
CONTROLLERS = ("rpp", "dwb", "mppi_nav2")
# The one that stays steady in the report quoted on the page.
FAR_LOOKAHEAD = "rpp:lookahead_dist=1.0"
SEEDS = range(1, 7)
REVERSED: dict[str, Any] = {"start_angles_rad": [3.0, 3.0]}
# A motor on a constant voltage with some compensation: no integral part, and softer.
OPEN_LOOP_MOTORS = {
    "response_time_constant_s": 0.03,
    "motors": {"stiffness_nms": 40.0, "integral_nm": 0.0},
}
# From when, s; v m/s, w rad/s.
MANOEUVRES: dict[str, tuple[list[tuple[float, float, float]], float]] = {
    "straight ahead": ([(0, 0.5, 0)], 0.0),
    "straight ahead, casters reversed": ([(0, 0.5, 0)], 3.0),
    "straight ahead, casters across": ([(0, 0.5, 0)], 1.57),
    "straight back": ([(0, -0.4, 0)], 0.1),
    "circle of 1 m": ([(0, 0.5, 0.5)], 0.0),
    "turning in place": ([(0, 0, 0.8)], 0.0),
    "slalom": ([(k, 0.4, 0.6 * (-1) ** k) for k in range(10)], 0.0),
    "back and forth": ([(k, 0.4 * (-1) ** (k // 2), 0) for k in range(10)], 0.1),
    "mixed": (
        [(0, 0.5, 0), (2, 0.3, 0.8), (4, 0, -1), (5.5, -0.4, 0.1), (7, 0.5, -0.3), (9, 0, 0)],
        3.0,
    ),
}


def manoeuvre_rows() -> Iterator[Sequence[str]]:
    """Yields the distances of planar model and ideal base from the multibody after 10 s."""
    yield ("manoeuvre", "way", "planar: position", "heading", "ideal: position", "heading")
    time_s = np.linspace(0.0, 10.0, 501)
    for name, (commands, angle) in MANOEUVRES.items():
        starts = np.array([float(start) for start, *_ in commands])
        told = np.array([[v, w, 0.0] for _, v, w in commands], dtype=float)
        states = {
            robot: drive_open_loop(
                _with_casters(robot, {"start_angles_rad": [angle, angle]}),
                np.zeros(6),
                time_s,
                starts,
                told,
            )
            for robot in (MULTIBODY, PLANAR, IDEAL)
        }
        way = np.hypot(*np.diff(states[MULTIBODY][:, :2], axis=0).T).sum()
        cells = [name, f"{way:.1f} m"]
        for robot in (PLANAR, IDEAL):
            apart = states[robot][-1] - states[MULTIBODY][-1]
            cells += [f"{1e3 * np.hypot(*apart[:2]):.0f} mm", f"{np.degrees(abs(apart[2])):.2f}°"]
        yield cells


def wobble_rows() -> Iterator[Sequence[str]]:
    """Yields the restlessness of each controller on 7.5 m straight ahead in an empty world."""
    controllers = (*CONTROLLERS, FAR_LOOKAHEAD)
    yield ("robot", *(f"`{controller}`" for controller in controllers))
    scenario = load_scenario("empty")
    for name, robot in _chairs():
        cells = [name]
        for controller in controllers:
            preset = load_preset(controller)
            specs = [TrialSpec(scenario, robot, preset, seed=seed) for seed in SEEDS]
            cells.append(_restlessness([simulate(spec) for spec in specs]))
        yield cells


def scenario_rows() -> Iterator[Sequence[str]]:
    """Yields the ends of trials in other scenarios on each robot."""
    yield ("scenario", "controller", "robot", "ended", "time", "clearance", "yaw rate")
    for name in ("doorway", "one_obstacle", "restricted_small"):
        scenario = load_scenario(name)
        for controller in CONTROLLERS:
            for robot in (IDEAL, PLANAR, MULTIBODY):
                loaded = scenario.load_robot(robot)
                logs = [
                    simulate(TrialSpec(scenario, loaded, load_preset(controller), seed=seed))
                    for seed in range(1, 5)
                ]
                ends = [str(log.outcome) for log in logs]
                counted = ", ".join(f"{ends.count(end)} {end}" for end in dict.fromkeys(ends))
                clearance = min(float(log.samples["clearance_m"].min()) for log in logs)
                w = np.mean([log.samples["w_radps"].std() for log in logs])
                time_s = np.mean([log.end_time_s for log in logs])
                yield (
                    f"`{name}`",
                    f"`{controller}`",
                    f"`{robot}`",
                    counted,
                    f"{time_s:.2f} s",
                    f"{clearance:.2f} m",
                    f"{w:.3f} rad/s",
                )


def _chairs() -> Iterator[tuple[str, Robot]]:
    """Yields robots with a name for the table; all casters are reversed at the start."""
    yield "ideal", load_robot(IDEAL)
    for robot, kind in ((PLANAR, "planar"), (MULTIBODY, "multibody")):
        for friction_nm in (0.5, 1.0, 2.0):
            casters = REVERSED | {"swivel_friction_nm": friction_nm}
            yield f"{kind}, {friction_nm:g} N m", _with_casters(robot, casters)
    for friction_nm in (0.5, 1.5):
        casters = REVERSED | {"swivel_friction_nm": friction_nm}
        drive = OPEN_LOOP_MOTORS | {"casters": casters}
        soft = overridden(load_robot(PLANAR), {"drive": drive}, "soft motors")
        yield f"planar, {friction_nm:g} N m, soft motors", soft


def _with_casters(robot: str, casters: dict[str, Any]) -> Robot:
    if robot == IDEAL:
        return load_robot(robot)
    return load_robot(robot, {"drive": {"casters": casters}})


def _restlessness(logs: Sequence[TrialLog]) -> str:
    """Returns the spread of the yaw rate from 3 s after the start to 2 s before the end, mean and
    range over the logs, how often a second it changes its sign beyond 0.01 rad/s, the largest
    heading, and the time; and how many trials reached the goal, where not all did.
    """
    rows = []
    for log in logs:
        samples = log.samples
        cruise = samples[(samples["time_s"] > 3.0) & (samples["time_s"] < log.end_time_s - 2.0)]
        w = cruise["w_radps"].to_numpy()
        signs = np.sign(w[np.abs(w) > 0.01])
        lasted_s = max(float(np.ptp(cruise["time_s"])), 1e-9)
        heading = np.degrees(samples["yaw_rad"].abs().max())
        reversals = np.count_nonzero(np.diff(signs)) / lasted_s
        rows.append((w.std(), reversals, heading, log.end_time_s))
    spread, reversals, heading, time_s = np.mean(rows, axis=0)
    low, high = np.min(rows, axis=0)[0], np.max(rows, axis=0)[0]
    reached = sum(log.outcome == Outcome.SUCCEEDED for log in logs)
    failed = "" if reached == len(logs) else f", {reached}/{len(logs)} reached"
    return (
        f"{spread:.4f} ({low:.4f} to {high:.4f}), {reversals:.1f}/s, {heading:.1f}°, "
        f"{time_s:.2f} s{failed}"
    )


def main(names: Sequence[str]) -> None:
    """Prints the tables that are named, or all."""
    tables = {"manoeuvres": manoeuvre_rows, "wobble": wobble_rows, "scenarios": scenario_rows}
    for name in names or tables:
        for index, cells in enumerate(tables[name]()):
            print(f"| {' | '.join(cells)} |", flush=True)
            if index == 0:
                print("|" + "---|" * len(cells), flush=True)
        print()


if __name__ == "__main__":
    main(sys.argv[1:])
