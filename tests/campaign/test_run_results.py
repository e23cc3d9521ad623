"""What `run_benchmark` returns can be looked at, reported and replayed."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from drake_navbench import TrialLog, run_benchmark
from drake_navbench.campaign.run_results import Results
from drake_navbench.errors import InputError

REPOSITORY = Path(__file__).parents[2]
IRON = REPOSITORY / "tests" / "nav2" / "nav2_files" / "iron.yaml"
WARD = REPOSITORY / "scenarios" / "maps" / "ward.yaml"


@pytest.fixture(scope="module")
def results():
    return run_benchmark(["restricted_small"], ["rpp"], trials=1, jobs=1)


def test_it_tells_itself_in_a_line_and_a_table(results):
    assert len(results) == 1
    assert repr(results) == "Results(1 trial: 1 aborted; in a temporary folder)"
    assert "restricted_small" in results._repr_html_()


def test_a_folder_that_stays_is_named(results):
    kept = Results(results.trials, Path("results/mine"))
    assert repr(kept) == "Results(1 trial: 1 aborted; results/mine)"


def test_a_log_is_found_by_its_names_and_a_wrong_one_is_one_line(results):
    log = results.log("restricted_small", "rpp")
    assert log.info["controller"] == "rpp"
    with pytest.raises(InputError, match="controller 'rp' was not run; did you mean 'rpp'"):
        results.log("restricted_small", "rp")
    with pytest.raises(InputError, match="no such file"):
        results.log("restricted_small", "rpp", 5)


def test_a_log_has_metrics_a_picture_and_a_replay(results, tmp_path):
    log = results.log("restricted_small", "rpp")
    metrics = log.metrics()
    assert metrics.loc["min_clearance_m", "value"] == results.trials["min_clearance_m"][0]
    assert metrics.loc["jerk_rms_mps3", "unit"] == "m/s³"
    assert metrics.loc["time_to_goal_s", "empty because"]
    assert log.plot()._repr_png_().startswith(b"\x89PNG")
    page = log.replay(tmp_path / "replay.html")
    assert "navbench-strip" in page.path.read_text(encoding="utf-8")
    assert "<iframe" in page._repr_html_()


def trials_of(*cells):
    """Returns rows; cells: scenario, controller, time to the goal, of four trials each."""
    return pd.DataFrame(
        [
            {
                "scenario": scenario,
                "controller": controller,
                "trial": trial,
                "seed": trial,
                "outcome": "succeeded",
                "time_to_goal_s": time_s,
            }
            for scenario, controller, time_s in cells
            for trial in range(4)
        ]
    )


def test_equal_trials_do_not_make_the_best_controller_surer():
    """Of two worlds in which nothing is random, b is slower in both, by 2 s and by 1 s."""
    cells = [("x", "a", 10.0), ("x", "b", 12.0), ("y", "a", 10.0), ("y", "b", 11.0)]
    results = Results(trials_of(*cells), Path("mine"))
    assert results.best() is None
    assert results.best(scenario="x") == "a"


def test_names_and_paths_may_be_plain_strings(tmp_path):
    """Each letter of a name was a scenario: 'e', 'm', 'p', 't', 'y'."""
    out = str(tmp_path / "out")
    found = run_benchmark("restricted_small", "rpp, dwb", trials=1, jobs=1, out=out)
    assert list(found.trials["controller"]) == ["rpp", "dwb"]
    log = TrialLog.read(f"{out}/trials/restricted_small/rpp/trial_000.parquet")
    assert log.info["controller"] == "rpp"


@pytest.mark.long
def test_report_and_replays_are_made_from_it(results):
    assert results.report().name == "report.html"
    assert results.replay("restricted_small").path.is_file()
    assert results.replay("restricted_small", "rpp").path.is_file()


def test_a_temporary_folder_goes_with_its_results():
    results = run_benchmark(["restricted_small"], ["rpp"], trials=1, jobs=1)
    path = results.path
    assert path.is_dir()
    del results
    assert not path.exists()


@pytest.mark.parametrize("jobs", [0, -1])
def test_no_workers_are_one_line_before_anything_is_written(jobs, tmp_path):
    with pytest.raises(InputError, match=f"jobs: expected at least 1, got {jobs}"):
        run_benchmark("restricted_small", "rpp", jobs=jobs, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_whole_nav2_files_and_a_map_are_asked_for_in_python(tmp_path):
    with pytest.raises(InputError, match="drive alike"):
        run_benchmark(nav2=IRON, against=IRON, map=WARD, goals=1, trials=1)
    with pytest.raises(InputError, match="expected a map as well"):
        run_benchmark(nav2=IRON, goals=1)
    other = tmp_path / "other.yaml"
    slower = IRON.read_text().replace("desired_linear_vel: 0.4", "desired_linear_vel: 0.3")
    other.write_text(slower)
    found = run_benchmark(nav2=IRON, against=other, map=WARD, goals=1, trials=1, jobs=1)
    assert list(found.trials["controller"]) == ["iron", "other"]
    speeds = found.trials.set_index("controller")["avg_linear_speed"]
    assert speeds["other"] < speeds["iron"]
