"""The local costmaps in a log, in a replay, and their texture."""

from __future__ import annotations

import dataclasses
import io

import matplotlib.image
import numpy as np
import pytest
from replay_logs import replay_log

from drake_navbench.analysis.cost_colors import palette, palette_rows
from drake_navbench.analysis.replay.costmaps import add_costmaps
from drake_navbench.analysis.replay.ground_texture import png
from drake_navbench.analysis.replay.stage import Stage
from drake_navbench.kernels.grid import FREE, INSCRIBED, LETHAL, NO_INFORMATION
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.trial.trial import run_trial


def turns(log: TrialLog, period_s: float) -> list[float]:
    """Returns the times at which a replay shows another costmap."""
    shown: list[float] = []
    stage = Stage()
    stage.take_turns = lambda turns: shown.extend(time_s for time_s, _ in turns)
    assert add_costmaps(stage, "/local_costmap", log, period_s) is bool(log.costmaps)
    return shown


def test_a_replay_shows_the_costmaps_of_the_log_at_their_own_times():
    log = replay_log("rpp", end_time_s=2.0)
    assert turns(log, 0.0) == [costmap.stamp_s for costmap in log.costmaps]


def test_costmaps_keep_the_period_of_the_page():
    assert np.diff(turns(replay_log("rpp"), 0.6)) == pytest.approx(0.6)


def test_a_log_without_costmaps_shows_none():
    assert turns(dataclasses.replace(replay_log("rpp"), costmaps=()), 0.2) == []


def test_the_log_holds_every_update_of_the_costmap_that_the_trial_had():
    log = run_trial("restricted_small", "rpp")
    stamps = [costmap.stamp_s for costmap in log.costmaps]
    # 5 Hz, the first one 0.01 s after the start.
    assert stamps == pytest.approx(np.arange(0.01, log.end_time_s, 0.2))
    # The trial's own costmap gave these distances, each at most a clearance period of 0.05 s and a
    # recorder period of 0.02 s old: at 0.5 m/s less than a cell's edge of 0.05 m.
    rows = log.samples[["time_s", "x_m", "y_m", "obstacle_cell_distance_m"]].to_numpy()
    for costmap in log.costmaps:
        later = rows[(rows[:, 0] > costmap.stamp_s + 0.1) & (rows[:, 0] < costmap.stamp_s + 0.2)]
        for _, x, y, logged in later:
            distance = np.min(np.hypot(*(costmap.lethal_centres - [x, y]).T))
            assert distance == pytest.approx(logged, abs=0.5 * (0.05 + 0.02))


def test_costmaps_come_back_from_the_file_as_they_were(tmp_path):
    log = replay_log("rpp", end_time_s=1.0)
    log.write(tmp_path / "log.parquet")
    back = TrialLog.read(tmp_path / "log.parquet").costmaps
    assert len(back) == len(log.costmaps) == 5
    for ours, theirs in zip(log.costmaps, back, strict=True):
        assert ours.costs.tobytes() == theirs.costs.tobytes()
        assert (ours.grid[1:], ours.stamp_s) == (theirs.grid[1:], theirs.stamp_s)


def test_without_costmaps_a_trial_is_the_same_and_its_log_smaller(tmp_path):
    kept = run_trial("restricted_small", "rpp", seed=3)
    bare = run_trial("restricted_small", "rpp", seed=3, keeps_costmaps=False)
    assert len(kept.costmaps) > 1
    assert bare.costmaps == ()
    assert kept.info == bare.info
    timing = list(UNREPEATABLE_COLUMNS)
    assert kept.samples.drop(columns=timing).equals(bare.samples.drop(columns=timing))
    for name, log in (("kept", kept), ("bare", bare)):
        log.write(tmp_path / name)
    assert (tmp_path / "bare").stat().st_size < (tmp_path / "kept").stat().st_size


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
