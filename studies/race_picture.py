"""The moving picture of the README: `python studies/race_picture.py` writes docs/images/race.svg.

Some controllers drive one scenario with the same seed; the picture shows them side by side in one
map, twice as fast as they drove, and starts again when the last one has ended.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

from drake_navbench import TrialLog, run_trial
from drake_navbench.analysis.colors import controller_color
from drake_navbench.analysis.figures.maps import bounds, course_of
from drake_navbench.analysis.metrics.body import outline_of
from drake_navbench.analysis.metrics.signals import positions
from drake_navbench.kernels.arrays import Array

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "race.svg"
SCENARIO, SEED = "static_obstacles", 0
CONTROLLERS = ("rpp", "dwb", "mppi", "teb", "harmony")
SPEED_UP, PAUSE_S, STEP_S = 2.0, 2.0, 0.2
WIDTH_PX, LEGEND_PX, MARGIN_PX = 900.0, 34.0, 16.0
INK, MUTED, WALL = "#1f2933", "#6b7480", "#b9c0c7"


class Sheet:
    """Places of the world on the picture: pixels of points in m, y downwards."""

    def __init__(self, low: Array, high: Array) -> None:
        self._low, self._high = low, high
        self.scale = WIDTH_PX / (high[0] - low[0])
        self.height_px = (high[1] - low[1]) * self.scale + LEGEND_PX

    def pixels(self, points: Array) -> Array:
        """Returns points (N, 2) in px of points (N, 2) in m of the world frame."""
        return (points - (self._low[0], self._high[1])) * (self.scale, -self.scale) + (0, LEGEND_PX)

    def polygon(self, corners: Array, style: str) -> str:
        """Returns a closed polygon of corners (K, 2) in m."""
        return f'<polygon points="{_pairs(self.pixels(corners))}" {style}/>'

    def line(self, points: Array, style: str) -> str:
        """Returns an open line through points (N, 2) in m."""
        return f'<polyline points="{_pairs(self.pixels(points))}" fill="none" {style}/>'


def drive() -> dict[str, TrialLog]:
    """Returns the log of each controller's trial."""
    return {name: run_trial(SCENARIO, name, seed=SEED) for name in CONTROLLERS}


def picture(logs: dict[str, TrialLog]) -> str:
    """Returns the SVG with the course, and each robot moving along its path."""
    sheet = Sheet(*bounds(list(logs.values())))
    course = course_of(next(iter(logs.values())))
    length_s = max(log.samples["time_s"].iloc[-1] for log in logs.values()) + PAUSE_S * SPEED_UP
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH_PX:.0f} '
        f'{sheet.height_px:.0f}" font-family="sans-serif" font-size="15">',
        f"<title>{escape(', '.join(logs))} drive {SCENARIO} with seed {SEED}</title>",
        '<rect width="100%" height="100%" fill="white"/>',
        *(
            sheet.polygon(corners, f'fill="{WALL}" stroke="{MUTED}"')
            for corners in course.obstacles
        ),
        *(sheet.line(plan, f'stroke="{MUTED}" stroke-dasharray="6 5"') for plan in course.plans),
        _goal(sheet, course.goal),
    ]
    left_px = MARGIN_PX
    for name, log in logs.items():
        color = controller_color(name, logs)
        parts.append(sheet.line(positions(log)[::4], f'stroke="{color}" stroke-opacity="0.55"'))
        parts.append(_robot(sheet, log, color, length_s))
        words = f"{name} {_end_of(log)}"
        parts.append(_key(words, color, left_px))
        left_px += 9.0 * len(words) + 40.0
    return "\n".join([*parts, "</svg>", ""])


def _end_of(log: TrialLog) -> str:
    seconds = f"{log.samples['time_s'].iloc[-1]:.1f} s"
    ended = str(log.outcome).replace("_", " ")
    return seconds if ended == "succeeded" else f"{ended}, {seconds}"


def _key(words: str, color: str, left_px: float) -> str:
    return (
        f'<rect x="{left_px:.0f}" y="10" width="14" height="14" fill="{color}"/>'
        f'<text x="{left_px + 20:.0f}" y="22" fill="{INK}">{escape(words)}</text>'
    )


def _goal(sheet: Sheet, goal: Array) -> str:
    x, y = sheet.pixels(goal[None])[0]
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="none" stroke="{INK}" stroke-width="2"/>'


def _robot(sheet: Sheet, log: TrialLog, color: str, length_s: float) -> str:
    """Returns the outline of a robot that moves as in its log and waits at its end."""
    times_s = log.samples["time_s"].to_numpy()
    shown_s = np.append(np.arange(times_s[0], times_s[-1], STEP_S), times_s[-1])
    places = sheet.pixels(
        np.column_stack([np.interp(shown_s, times_s, column) for column in positions(log).T])
    )
    yaw_rad = np.interp(shown_s, times_s, np.unwrap(log.samples["yaw_rad"].to_numpy()))
    moves = [f"{x:.1f},{y:.1f}" for x, y in places]
    turns = [f"{-angle:.1f}" for angle in np.degrees(yaw_rad)]
    # The last place holds until the picture starts again.
    keys = ";".join(f"{second / length_s:.4f}" for second in [*shown_s, length_s])
    timing = f'keyTimes="{keys}" dur="{length_s / SPEED_UP:.2f}s" repeatCount="indefinite"'
    outline = _pairs(outline_of(log) * (sheet.scale, -sheet.scale))
    return (
        f'<g><animateTransform attributeName="transform" type="translate" {timing} '
        f'values="{";".join([*moves, moves[-1]])}"/><g>'
        f'<animateTransform attributeName="transform" type="rotate" {timing} '
        f'values="{";".join([*turns, turns[-1]])}"/>'
        f'<polygon points="{outline}" fill="{color}" fill-opacity="0.25" stroke="{color}" '
        f'stroke-width="2"/></g></g>'
    )


def _pairs(points: Array) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def main() -> None:
    """Drives the trials and writes the picture."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    PICTURE.write_text(picture(drive()), encoding="utf-8")


if __name__ == "__main__":
    main()
