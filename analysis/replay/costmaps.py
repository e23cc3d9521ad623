"""The local costmap of a trial as a coloured texture on the floor."""

from __future__ import annotations

from pydrake.geometry import Rgba

from drake_navbench.analysis.replay.ground_texture import textured_square
from drake_navbench.analysis.replay.moving_shapes import on_floor
from drake_navbench.analysis.replay.odometry_frame import world_from_odometry
from drake_navbench.analysis.replay.stage import Stage, frame_of, spaced_in_time
from drake_navbench.logs.log import TrialLog

COSTMAP_COLOR = Rgba(0.86, 0.35, 0.16, 1.0)
# One texture takes about 5 kB of the page.
MAX_COSTMAP_TURNS = 60


def add_costmaps(
    stage: Stage, path: str, log: TrialLog, period_s: float, *, max_turns: int = MAX_COSTMAP_TURNS
) -> bool:
    """Shows the logged costmaps, each until the next one; returns whether the log has any.

    max_turns: the most costmaps that are shown, evenly spread.
    """
    period_s = max(period_s, log.samples["time_s"].iloc[-1] / max_turns)
    shown: list[tuple[float, str | None]] = []
    for time_s, costmap in spaced_in_time([(c.stamp_s, c) for c in log.costmaps], period_s):
        name = f"{path}/{frame_of(time_s)}"
        stage.meshcat.SetObject(name, textured_square(costmap))
        pose = world_from_odometry(log, costmap.stamp_s)
        if pose is not None:
            stage.pose(name, on_floor(pose))
        shown.append((time_s, name))
    stage.take_turns(shown)
    return bool(shown)
