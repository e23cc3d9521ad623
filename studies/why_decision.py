"""The picture of one cycle of DWB in why.md.

`python studies/why_decision.py` drives `dwb` through `doorway` up to that cycle and writes
docs/images/why_dwb.svg.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from drake_navbench.analysis.figures.style import (
    OBSTACLE_FACE,
    PLAN_COLOR,
    SVG,
    figure_style,
    legend_above,
    new_figure,
    write_figure,
)
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.kernels.poses import place_outline
from drake_navbench.trial.column_controller import built_controller
from drake_navbench.trial.diagram import Observers
from drake_navbench.trial.simulation import simulate_with

STEM = Path(__file__).parents[1] / "docs" / "images" / "why_dwb"
SCENARIO, CONTROLLER, AT_S = "doorway", "dwb", 5.3
ILLEGAL_COLOR, LEGAL_COLOR, CHOSEN_COLOR = "#e6a19c", "#1a8c73", "#cc1a1a"


def main() -> None:
    """Drives the trial up to the cycle and draws its trajectories."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    (spec,) = plan_campaign([SCENARIO], [CONTROLLER], trials=1).specs
    cycles = []
    with built_controller(spec.preset, spec.robot, wants_diagnostics=True) as controller:
        simulate_with(controller, spec, Observers(on_cycle=cycles.append), until_s=AT_S)
        cycle = next(entry for entry in reversed(cycles) if entry.command is not None)
        shown = controller.step(cycle.observation, cycle.memory).diagnostics
    seen = cycle.observation
    legal = shown["sampled_is_legal"]
    lethal = seen.costmap.lethal_centres
    with figure_style():
        figure, (axes,) = new_figure(1, 1, axes_size_in=(6.5, 4.4))
        axes.scatter(*lethal.T, marker="s", s=14, color=OBSTACLE_FACE, label="lethal cells")
        axes.plot(*seen.plan[:, :2].T, color=PLAN_COLOR, lw=1.2, ls="--", label="plan")
        # Of those that hit every fourth is drawn: their fan is as wide.
        for flags, color, every, name in (
            (~legal, ILLEGAL_COLOR, 4, f"{np.count_nonzero(~legal)} that hit"),
            (legal, LEGAL_COLOR, 1, f"{np.count_nonzero(legal)} that do not"),
        ):
            for index, motion in enumerate(shown["sampled_trajectories"][flags][::every]):
                label = name if index == 0 else None
                axes.plot(*motion[::4, :2].T, color=color, lw=0.3 + 0.9 / every, label=label)
        chosen = shown["predicted_trajectory"]
        axes.plot(*chosen[:, :2].T, color=CHOSEN_COLOR, lw=2.2, label="chosen")
        for pose, style in ((seen.pose, "-"), (chosen[-1], ":")):
            outline = place_outline(spec.robot.padded_outline, pose)
            axes.plot(*np.vstack([outline, outline[:1]]).T, color=CHOSEN_COLOR, lw=1.0, ls=style)
        x, y = seen.pose[:2]
        axes.set_aspect("equal")
        axes.set_xlim(x - 0.6, x + 2.4)
        axes.set_ylim(y - 1.0, y + 1.0)
        axes.set_xlabel("x [m]")
        axes.set_ylabel("y [m]")
        legend_above(axes)
        write_figure(figure, STEM, [SVG])


if __name__ == "__main__":
    main()
