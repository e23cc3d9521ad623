"""The picture of one cycle in harmony.md, and how long cycles take.

`python studies/harmony_cycle.py` writes docs/images/harmony_cycle.svg. No trial is driven: harmony
is asked for one decision in front of two boxes. With --times it draws nothing: it drives a trial
each of TIMED and prints the processor time of their cycles.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from harmony_families import write_world

from drake_navbench import run_trial
from drake_navbench.analysis.figures.style import (
    OBSTACLE_EDGE,
    OBSTACLE_FACE,
    PLAN_COLOR,
    SVG,
    figure_style,
    legend_above,
    new_figure,
    write_figure,
)
from drake_navbench.analysis.metrics.compute import cycle_times_ms
from drake_navbench.controller import Observation
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.kernels.poses import place_outline
from drake_navbench.trial.column_controller import controller_setup
from drake_navbench.trial.trial import DEFAULT_ROBOT

STEM = Path(__file__).parents[1] / "docs" / "images" / "harmony_cycle"
CELLS, RESOLUTION_M = 120, 0.05
# x0, y0, x1, y1 m: one on the path, one beside it.
BOXES = ((1.65, -0.1, 1.8, 0.05), (2.2, 0.85, 2.6, 1.3))
SPEED_MPS = 0.45
GUESS_COLOR, CHOSEN_COLOR, STOP_COLOR = "#7d93a8", "#cc1a1a", "#731a8c"

# Scenarios, and try-out worlds of a family with their numbers.
TIMED: tuple[str | tuple[str, int], ...] = (
    *("empty", "doorway", "ward_crowd"),
    *(("s_curve", 8100), ("clutter", 8101)),
)
TIMED_SEED = 1000


def observation() -> Observation:
    """Returns the observation of a robot that drives along x towards the boxes."""
    costs = np.zeros((CELLS, CELLS), dtype=np.uint8)
    half_m = 0.5 * CELLS * RESOLUTION_M
    for x0, y0, x1, y1 in BOXES:
        first = np.round((np.array([y0, x0]) + half_m) / RESOLUTION_M).astype(int)
        last = np.round((np.array([y1, x1]) + half_m) / RESOLUTION_M).astype(int)
        costs[first[0] : last[0], first[1] : last[1]] = LETHAL
    x = np.arange(0.0, 2.8, RESOLUTION_M)
    plan = np.column_stack([x, np.zeros_like(x), np.zeros_like(x)])
    return Observation(
        time_s=0.0,
        pose=np.zeros(3),
        twist=np.array([SPEED_MPS, 0.0]),
        plan=plan,
        plan_id=1,
        costmap=Costmap(costs, -half_m, -half_m, RESOLUTION_M),
        goal=np.array([8.0, 0.0, 0.0]),
    )


def times() -> None:
    """Prints the processor time of a cycle, ms: median and 99th percentile, by trial and of all."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for one in TIMED:
            scenario = one if isinstance(one, str) else str(write_world(Path(folder), *one))
            log = run_trial(scenario, "harmony", seed=TIMED_SEED)
            found[Path(scenario).stem] = cycle_times_ms(log, "compute_cpu_time_ms")
    found["all"] = np.concatenate(list(found.values()))
    for name, cycles_ms in found.items():
        median_ms, late_ms = np.percentile(cycles_ms, [50.0, 99.0])
        print(f"{name}: {len(cycles_ms)} cycles, {median_ms:.1f} ms, 99th percentile {late_ms:.1f}")


def main() -> None:
    """Asks harmony for one decision and draws what it had in mind, or times cycles."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", action="store_true", help="draws nothing")
    if parser.parse_args().times:
        times()
        return
    preset = load_preset("harmony")
    setup = controller_setup(load_robot(DEFAULT_ROBOT), wants_diagnostics=True)
    controller = preset.controller_class(preset.parameters, setup)
    seen = observation()
    shown = controller.step(seen, controller.initial_memory()).diagnostics
    with figure_style():
        figure, (axes,) = new_figure(1, 1, axes_size_in=(6.5, 4.6))
        for x0, y0, x1, y1 in BOXES:
            corners = ([x0, x1, x1, x0], [y0, y0, y1, y1])
            axes.fill(*corners, facecolor=OBSTACLE_FACE, edgecolor=OBSTACLE_EDGE)
        axes.plot(*seen.plan[:, :2].T, color=PLAN_COLOR, lw=1.0, ls="--", label="path")
        free = np.isfinite(shown["sampled_costs"])
        for index, motion in enumerate(shown["sampled_trajectories"][free]):
            label = "guesses" if index == 0 else None
            axes.plot(*motion[:, :2].T, color=GUESS_COLOR, lw=1.2, label=label)
        chosen, stop = shown["predicted_trajectory"], shown["stop_trajectory"]
        axes.plot(*chosen[:, :2].T, color=CHOSEN_COLOR, lw=1.6, label="accepted")
        axes.plot(*stop[:, :2].T, color=STOP_COLOR, lw=3.0, ls=":", label="stop plan")
        for pose in (seen.pose, stop[-1]):
            outline = place_outline(setup.footprint, pose)
            axes.plot(*np.vstack([outline, outline[:1]]).T, color=STOP_COLOR, lw=0.8)
        axes.set_aspect("equal")
        axes.set_xlim(-0.5, 2.9)
        axes.set_ylim(-1.3, 1.4)
        legend_above(axes)
        write_figure(figure, STEM, [SVG])


if __name__ == "__main__":
    main()
