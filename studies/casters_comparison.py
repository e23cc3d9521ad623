"""The table of docs/casters.md: `python studies/casters_comparison.py` prints it in Markdown.

The planar model and the ideal base are driven by the commands of some manoeuvres, without feedback,
and compared with the multibody model.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence

import numpy as np

from drake_navbench.inputs.robot import Robot, load_robot
from drake_navbench.trial.open_loop import drive_open_loop

IDEAL, PLANAR, MULTIBODY = "wheelchair", "wheelchair_casters", "wheelchair_multibody"
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
                _with_casters(robot, angle),
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


def _with_casters(robot: str, angle_rad: float) -> Robot:
    """Returns a robot whose casters, if it has any, start at an angle."""
    if robot == IDEAL:
        return load_robot(robot)
    return load_robot(robot, {"drive": {"casters": {"start_angles_rad": [angle_rad, angle_rad]}}})


def main() -> None:
    """Prints the table."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    for index, cells in enumerate(manoeuvre_rows()):
        print(f"| {' | '.join(cells)} |", flush=True)
        if index == 0:
            print("|" + "---|" * len(cells), flush=True)


if __name__ == "__main__":
    main()
