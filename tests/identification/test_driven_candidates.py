"""Trials that are really driven: by RPP, which gives up in front of a wall after half a second."""

from __future__ import annotations

import json

import numpy as np
import pytest

from drake_navbench.commands import identify as command
from drake_navbench.identification.driving import Driver, means_of
from drake_navbench.identification.targets import Pair, published_targets
from drake_navbench.identification.unknowns import Settings, load_unknowns

PAIR = Pair("restricted_small", "rpp")
TRUE_FRONT_M = 1.69


@pytest.fixture(scope="module")
def unknowns():
    return load_unknowns(None, published_targets(), "wheelchair")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("logs")


@pytest.fixture(scope="module")
def driven(unknowns, folder):
    """The trial with the wall where it is searched for."""
    settings = Settings(layouts={PAIR.scenario: {"front_m": TRUE_FRONT_M}})
    driver = Driver(unknowns, folder, jobs=1)
    rows = driver.rows(settings, [PAIR], trials=(0,), seed=0)
    assert driver.driven_count == 1
    return settings, rows


def test_a_trial_is_driven_once_and_then_read(unknowns, folder, driven):
    settings, rows = driven
    driver = Driver(unknowns, folder, jobs=1)
    (again,) = driver.means_of_each([(settings, [PAIR])], trials=(0,), seed=0)
    np.testing.assert_equal(again, means_of(rows))
    assert driver.driven_count == 0


def test_a_log_that_was_cut_off_is_driven_again(unknowns, folder, driven):
    settings, rows = driven
    (path,) = folder.rglob("*.parquet")
    path.write_bytes(path.read_bytes()[:1000])
    driver = Driver(unknowns, folder, jobs=1)
    assert driver.rows(settings, [PAIR], trials=(0,), seed=0) == rows
    assert driver.driven_count == 1


def test_settings_that_cannot_be_driven_have_no_numbers(unknowns, folder):
    # The wall would stand in the robot.
    inside = Settings(layouts={PAIR.scenario: {"front_m": 0.3}})
    driver = Driver(unknowns, folder, jobs=1)
    assert driver.means_of_each([(inside, [PAIR])], trials=(0,), seed=0) == [{}]


def test_a_planted_wall_is_found_again_from_what_rpp_did_before_it(tmp_path, driven):
    _, rows = driven
    planted = {c.metric: v for c, v in means_of(rows).items()}
    lines = ["scenario,metric,unit,rpp"]
    for metric in ("path_length", "time_taken", "max_path_error", "energy"):
        lines.append(f"{PAIR.scenario},{metric},m,{planted[metric]:.4f}")
    tables, unknowns, out = (tmp_path / name for name in ("tables.csv", "unknowns.yaml", "out"))
    tables.write_text("\n".join(lines) + "\n", encoding="utf-8")
    unknowns.write_text(
        'layouts: {restricted_small: {front_m: "1.45:1.75"}}\n'
        "controllers: {rpp: {preset: rpp, blind: rpp_bringup}}\n",
        encoding="utf-8",
    )
    arguments = [
        "--tables",
        str(tables),
        "--unknowns",
        str(unknowns),
        "--budget",
        "22",
        "--rounds",
        "6",
    ]
    status = command.main([*arguments, "--trials", "1", "--jobs", "1", "--out", str(out)])
    assert status == 0
    result = json.loads((out / "identification.json").read_text(encoding="utf-8"))
    (run,) = result["runs"]
    ((found,),) = (block["values"] for block in run["blocks"])
    # A control cycle at full speed is 2.5 cm, half a cell of the costmap.
    assert found["found"] == pytest.approx(TRUE_FRONT_M, abs=0.026)
    assert run["scores"]["fitted"]["together"]["median_error"] == pytest.approx(0.0, abs=1e-3)
    assert run["scores"]["shipped"]["together"]["median_error"] > 0.05
    page = (out / "identification.md").read_text(encoding="utf-8")
    assert "Nothing was held out: what agrees here is fitted, and confirms nothing." in page


def test_a_range_in_which_nothing_can_be_driven_is_one_line(tmp_path, capsys):
    unknowns = tmp_path / "unknowns.yaml"
    unknowns.write_text(
        'layouts: {restricted_small: {front_m: "0.2:0.3"}}\n'
        "controllers: {rpp: {preset: rpp, blind: rpp_bringup}}\n",
        encoding="utf-8",
    )
    arguments = [
        "--unknowns",
        str(unknowns),
        "--controllers",
        "rpp",
        "--budget",
        "22",
        "--jobs",
        "1",
    ]
    only = ["--scenarios", "restricted_small", "--out", str(tmp_path / "out")]
    assert command.main([*arguments, *only]) == 2
    shown = capsys.readouterr().err
    assert shown.startswith("identify: rpp in restricted_small: none of 16 settings can be driven")
    assert shown.count("\n") == 1
