"""A studio's trial is the one that `run` drives; its workers stay."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.errors import InputError
from drake_navbench.inputs.scenario import SCENARIO_FILES
from drake_navbench.studio.drawing import EMPTY_FLOOR
from drake_navbench.studio.engine import Engine, NoResult
from drake_navbench.studio.messages import Column, DrawnScenario
from drake_navbench.studio.moments import image_of, moment_at, rows_of, trajectories_of
from drake_navbench.studio.tasks import drive_column, read_watched, reasons_of, spec_of
from drake_navbench.typed_files.typed_yaml import read_yaml

pytestmark = pytest.mark.usefixtures("real_workers")

DOORWAY = SCENARIO_FILES.find("doorway")
DRAWN = DrawnScenario(read_yaml(DOORWAY), str(DOORWAY))


def test_the_specification_is_the_first_that_run_drives():
    column = Column("rpp", changes=(("lookahead_dist", 0.9),))
    (theirs,) = plan_campaign(["doorway"], ["rpp:lookahead_dist=0.9"], trials=1).specs
    ours = spec_of(DRAWN, column, "wheelchair")
    assert (ours.identity, ours.seed) == (theirs.identity, theirs.seed)


def test_changes_are_written_as_the_command_line_takes_them():
    column = Column("dwb", changes=(("PathAlign.scale", 16.0), ("include_last_point", False)))
    assert column.argument == "dwb:PathAlign.scale=16.0:include_last_point=false"


def test_a_wrong_value_is_told_in_the_loaders_words():
    with pytest.raises(InputError, match="max_linear_vel: input should be greater than 0, got -1"):
        spec_of(DRAWN, Column("rpp", changes=(("max_linear_vel", -1.0),)), "wheelchair")


def test_a_trial_can_be_looked_at_moment_by_moment(tmp_path):
    driven = drive_column(DRAWN, Column("rpp"), "wheelchair", str(tmp_path / "a.parquet"))
    assert driven.outcome == "succeeded"
    assert driven.poses[0] == pytest.approx([0.0, -1.0, 0.0])
    watched = read_watched(driven.log)
    assert np.array_equal(watched.poses, driven.poses)
    moment = moment_at(watched, 5.0)
    assert watched.times_s[moment.sample] == pytest.approx(5.0, abs=0.021)
    assert 4.7 <= moment.costmap.time_s <= 5.0
    assert image_of(moment.costmap).shape == moment.costmap.costs.shape
    rows = dict(rows_of(watched, moment))
    assert rows["lookahead_distance_m"] == "0.6"
    assert moment_at(watched, 0.0).sample == 0
    assert trajectories_of(moment)[0] == []
    assert moment.decision is None


@pytest.mark.long
def test_every_decision_of_a_trial_is_told_with_the_costs_of_its_critics(tmp_path):
    driven = drive_column(DRAWN, Column("dwb"), "wheelchair", str(tmp_path / "a.parquet"))
    found = reasons_of(driven.log, driven.drive)
    watched = read_watched(driven.log)._replace(decisions=found.decisions, cycles=found.cycles)
    assert len(watched.decisions) == len(watched.cycles)
    moment = moment_at(watched, 3.0)
    assert moment.decision["time"] == pytest.approx(2.97, abs=0.05)
    columns, rows = moment.decision["columns"], moment.decision["rows"]
    table = {row[0]: dict(zip(columns, row, strict=True)) for row in rows}
    command = dict(rows_of(watched, moment))["commanded speed [m/s]"]
    assert table["v [m/s]"]["chosen"] == command
    assert float(table["total"]["chosen"]) <= float(table["total"]["next"])
    assert moment.decision["notes"][-1].endswith("equal the log to the last bit.")
    # The arrays of the cycle, which the log leaves out, come with it.
    assert trajectories_of(moment)[0]


def test_a_trial_whose_scenario_was_changed_is_not_explained(tmp_path):
    driven = drive_column(DRAWN, Column("rpp"), "wheelchair", str(tmp_path / "a.parquet"))
    content = {**DRAWN.content, "timeout_s": 90.0}
    with pytest.raises(InputError, match="expected unchanged inputs"):
        reasons_of(driven.log, (DRAWN._replace(content=content), *driven.drive[1:]))


@pytest.mark.long
def test_memory_is_steady_over_200_drives():
    """From the 40th to the 200th drive; a driving worker is replaced after 500 trials."""
    engine = Engine()
    try:
        engine.metrics.result()
        held = []
        for number in range(200):
            column = Column("rpp", changes=(("lookahead_dist", 0.5 + 0.001 * number),))
            engine.look("check_drawing", DRAWN, "wheelchair").result()
            driven = engine.drive("drive_column", DRAWN, column, "wheelchair", engine.new_log())
            assert driven.result().outcome
            if number in (39, 199):
                workers = (engine._looks._worker.pid, engine._drives._worker.pid)
                held.append([resident_mb(pid) for pid in (os.getpid(), *workers)])
        print("resident, MB, after 40 and after 200 drives:", held)
        page, looks, drives = (after - before for before, after in zip(*held, strict=True))
        assert max(page, looks) < 5.0
        assert drives < 0.2 * 160
        assert len(list(Path(driven.result().log).parent.glob("*.parquet"))) <= 6
    finally:
        engine.close()


def resident_mb(pid: int) -> float:
    (line,) = [
        line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if "VmRSS" in line
    ]
    return int(line.split()[1]) / 1024.0


@pytest.mark.long
def test_a_trial_that_is_stopped_leaves_a_studio_that_drives_the_next_one():
    engine = Engine()
    try:
        engine.metrics.result()
        far = {
            **EMPTY_FLOOR,
            "goal": [3000.0, 0.0, 0.0],
            "plan": {"type": "polyline", "points": [[0.0, 0.0], [3000.0, 0.0]]},
            "timeout_s": 7000.0,
        }
        drawn = DrawnScenario(far, "/tmp/far.yaml")
        begun = engine.drive("drive_column", drawn, Column("rpp"), "wheelchair", engine.new_log())
        while not begun.running():
            pass
        engine.stop_driving()
        with pytest.raises(NoResult, match="ended by signal 9"):
            begun.result()
        again = engine.drive("drive_column", DRAWN, Column("rpp"), "wheelchair", engine.new_log())
        assert again.result().outcome == "succeeded"
    finally:
        engine.close()
