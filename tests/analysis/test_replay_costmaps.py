"""The local costmap of a replay, made again from the log, and its texture."""

from __future__ import annotations

import io

import matplotlib.image
import numpy as np
import pytest
from replay_logs import BOX_FACE_Y_M, replay_log

from drake_navbench.analysis.replay.actors import base_motion
from drake_navbench.analysis.replay.costmaps import local_costmaps
from drake_navbench.analysis.replay.ground_texture import palette, palette_rows, png
from drake_navbench.inputs.robot import Robot
from drake_navbench.kernels.grid import FREE, INSCRIBED, LETHAL, NO_INFORMATION
from drake_navbench.log import TrialLog
from drake_navbench.trial.trial import run_trial


def costmaps_of(log, period_s=0.0) -> list:
    robot = Robot.model_validate(log.info["robot"])
    return list(local_costmaps(log, robot, base_motion(log), period_s))


def test_costmap_shows_the_scanned_wall_and_moves_with_the_robot():
    costmaps = costmaps_of(replay_log("rpp", end_time_s=2.0))
    for costmap in costmaps:
        # Hits lie on the face, so in one of the two rows of cells that meet there.
        offsets = np.abs(costmap.lethal_centres[:, 1] - BOX_FACE_Y_M)
        assert len(offsets) > 0
        assert (offsets <= 0.5 * costmap.resolution + 1e-9).all()
    # 0.5 m/s; ten updates of 0.2 s, the last one at 1.8 s; whole cells of 0.05 m.
    moved_m = costmaps[-1].origin_x - costmaps[0].origin_x
    assert moved_m == pytest.approx(0.5 * 1.8, abs=costmaps[0].resolution)


def test_costmaps_keep_their_period():
    stamps = [costmap.stamp_s for costmap in costmaps_of(replay_log("rpp"), period_s=0.6)]
    assert np.diff(stamps) == pytest.approx(0.6)


def test_log_without_scans_gives_no_costmap():
    log = replay_log("rpp")
    blind = TrialLog(samples=log.samples, plans=log.plans, info=log.info)
    assert costmaps_of(blind) == []


def test_costmap_is_the_one_that_the_trial_had():
    log = run_trial("restricted_small", "rpp")
    # The trial's own costmap gave these distances, each at most a clearance period of 0.05 s and a
    # recorder period of 0.02 s old: at 0.5 m/s less than a cell's edge of 0.05 m.
    rows = log.samples[["time_s", "x_m", "y_m", "obstacle_cell_distance_m"]].to_numpy()
    costmaps = costmaps_of(log)
    assert len(costmaps) >= 3
    for costmap in costmaps:
        later = rows[rows[:, 0] > costmap.stamp_s + 0.1]
        for _, x, y, logged in later[:5]:
            distance = np.min(np.hypot(*(costmap.lethal_centres - [x, y]).T))
            assert distance == pytest.approx(logged, abs=0.5 * (0.05 + 0.02))


def test_palette_keeps_the_special_costs_apart():
    rows = palette_rows()
    shown = [rows[cost] for cost in (FREE, 1, 252, INSCRIBED, LETHAL, NO_INFORMATION)]
    assert shown == [0, 1, 12, 13, 14, 15]
    assert len(palette()) == 16


def test_palette_grows_denser_with_the_cost():
    alphas = palette()[palette_rows()[1:253], 3].astype(int)
    assert (np.diff(alphas) >= 0).all()


def test_png_is_an_image_of_the_colours():
    colors = np.array([[0, 0, 0, 0], [255, 51, 0, 255]], dtype=np.uint8)
    rows = np.array([[0, 1, 0], [1, 1, 1]], dtype=np.uint8)
    image = matplotlib.image.imread(io.BytesIO(png(rows, colors)))
    np.testing.assert_allclose(image, colors[rows] / 255, atol=1e-6)
