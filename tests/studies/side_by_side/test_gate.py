"""The gate: what it calls red, and what it says."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.paired_comparison import detectable_difference
from drake_navbench.analysis.paired_tests import PairedVerdict
from drake_navbench.commands.main import main
from drake_navbench.studies.side_by_side.gate import (
    GateResult,
    Light,
    Side,
    column_of,
    drive_gate,
    judge_rows,
    read_rows,
)
from drake_navbench.studies.side_by_side.gate_report import to_junit, to_markdown, worst_logs

PAIRS = 64
BASE, HEAD = Side("base", "Nav2 jazzy 1.3.7 at abc"), Side("head")
SUCCEEDED = ["succeeded"] * PAIRS


def _trials(**values) -> pd.DataFrame:
    """Returns PAIRS trials of one controller; a metric that is not given wanders around 1."""
    wandering = 1.0 + 0.01 * np.arange(PAIRS)
    rows = {metric.name: wandering for metric in all_metrics()}
    numbers = {"trial": range(PAIRS), "seed": range(PAIRS), "outcome": SUCCEEDED, "reason": ""}
    return pd.DataFrame({"scenario": "doorway", "controller": "rpp"} | numbers | rows | values)


def _table(before: pd.DataFrame, after: pd.DataFrame) -> pd.DataFrame:
    return pd.concat(
        [before.assign(controller="rpp@base"), after.assign(controller="rpp@head")],
        ignore_index=True,
    )


def _gate(before: pd.DataFrame, after: pd.DataFrame) -> GateResult:
    return judge_rows(_table(before, after), ["rpp"], BASE, HEAD)


def _ending(count: int, outcome: str) -> list[str]:
    return [outcome] * count + SUCCEEDED[count:]


def test_equal_trials_are_equal_in_everything_and_green():
    result = _gate(_trials(), _trials())
    assert result.light is Light.GREEN
    assert {finding.verdict for finding in result.judged.findings} == {PairedVerdict.EQUAL}
    assert "64 of 64 pairs of trials are equal" in to_markdown(result)


def test_what_depends_on_the_machine_or_has_no_good_direction_is_no_test():
    slow = _trials(compute_time_p95_ms=np.full(PAIRS, 9.0), duration_s=np.full(PAIRS, 9.0))
    assert _gate(_trials(), slow).judged.equal == PAIRS


@pytest.mark.parametrize("count", [1, 4, 10])
def test_a_head_that_crashes_is_red_and_every_trial_is_named(count):
    after = _trials(outcome=_ending(count, "error"), reason="worker ended by SIGABRT")
    result = _gate(_trials(), after)
    assert result.light is Light.RED
    text = to_markdown(result)
    assert text.startswith("# Nav2 gate: red\n")
    seeds = ", ".join(map(str, range(count)))
    assert f"ended as an error, seed{'s' * (count > 1)} {seeds}: worker ended by SIGABRT" in text
    suite = ElementTree.fromstring(to_junit(result))[0]
    failed = {case.get("name") for case in suite if case.find("failure") is not None}
    assert {f"seed {seed}" for seed in range(count)} <= failed


def test_a_head_with_missing_trials_is_red_and_they_are_named():
    result = _gate(_trials(), _trials()[3:])
    assert result.light is Light.RED
    assert "doorway, rpp: 3 trials missing, seeds 0, 1, 2" in to_markdown(result)


def test_a_head_that_crashes_as_its_base_does_is_not_judged():
    before, after = (_trials(outcome=np.roll(_ending(4, "error"), shift)) for shift in (0, 9))
    result = _gate(before, after)
    assert result.light is Light.NOT_JUDGED
    assert "4 trials ended as an error, seeds 9, 10, 11, 12" in to_markdown(result)
    suite = ElementTree.fromstring(to_junit(result))[0]
    assert (suite.get("failures"), suite.get("errors")) == ("0", "4")


def test_a_head_without_any_value_of_a_listed_metric_is_not_judged():
    result = _gate(_trials(), _trials(min_clearance_m=np.nan))
    assert result.light is Light.NOT_JUDGED
    told = to_markdown(result).partition("## Measured in the base alone")[2]
    assert told.startswith("\n\n- doorway, rpp: min_clearance_m\n")
    # Where the base has none either, as without an obstacle, there is nothing to lose.
    empty = _trials(min_clearance_m=np.nan)
    assert _gate(empty, empty).light is Light.GREEN


def test_a_head_that_touches_in_a_quarter_of_the_trials_is_red():
    result = _gate(_trials(), _trials(outcome=_ending(16, "collided")))
    assert result.light is Light.RED
    worse = [finding.quantity.name for finding in result.regressions]
    # Both have the same 16 pairs; the touch comes first.
    assert worse == ["touch_rate", "success_rate"]
    # 2 tests of 2 x 2^-16.
    assert result.regressions[0].p_value == pytest.approx(2 * 2.0**-15)


def test_a_loss_that_is_not_decided_is_green_and_listed():
    # 4 of 4 one way: p 0.125, whatever else is tested.
    result = _gate(_trials(), _trials(outcome=_ending(4, "aborted")))
    assert result.light is Light.GREEN
    told = to_markdown(result).partition("## Losses that so few trials do not decide")[2]
    assert "success_rate undecided: 100 -> 93.75 % (-6.25 [-15.2, +1.42] in 64 pairs, " in told
    # 6 pairs of one sign have p 2^-5, 7 have 2^-6, which is below 3%; a sixteenth of 112 is 7.
    assert "needs at least 7 pairs that differ one way, a change of this size about 112" in told


def test_a_red_gate_says_what_became_worse():
    after = _trials(time_to_goal_s=_trials()["time_to_goal_s"] + 0.5)
    result = _gate(_trials(), after)
    text = to_markdown(result)
    assert text.startswith("# Nav2 gate: red\n")
    assert "`base`, Nav2 jazzy 1.3.7 at abc" in text
    assert "| doorway | rpp | time_to_goal_s [s] | 1.315 | 1.815 | +0.5 |" in text
    suite = ElementTree.fromstring(to_junit(result))[0]
    (failed,) = suite.iterfind("testcase/failure/..")
    assert (failed.get("classname"), failed.get("name")) == ("doorway.rpp", "time_to_goal_s")


def test_a_green_gate_says_what_it_would_have_seen():
    random = np.random.default_rng(2)
    noisy = _trials(time_to_goal_s=random.normal(1.3, 0.1, PAIRS))
    result = _gate(_trials(), noisy)
    (finding,) = (f for f in result.judged.findings if f.quantity.name == "time_to_goal_s")
    text = to_markdown(result)
    assert text.startswith("# Nav2 gate: green\n")
    seen = text.partition("The smallest changes that would be seen")[2]
    assert "A trial that ends in an error turns the gate red. So do 7 trials" in seen
    # One test of a listed metric has noise, and so all of its family's 1%.
    assert f" {detectable_difference(finding.comparison.sd, PAIRS, 0.01):.2g} |" in seen


def test_too_few_trials_for_any_alarm_are_told():
    # 7 pairs of one sign are needed.
    assert "**6 trials are too few**" in to_markdown(_gate(_trials()[:6], _trials()[:6]))
    assert "too few" not in to_markdown(_gate(_trials()[:7], _trials()[:7]))


def test_the_worst_seed_of_a_touch_is_one_that_touches_in_the_head_alone(tmp_path):
    before = _trials(outcome=_ending(1, "collided"))
    after = _trials(outcome=_ending(20, "collided"))
    logs = worst_logs(_gate(before, after)._replace(folder=tmp_path))
    assert [log.name for log in logs] == ["trial_001.parquet"] * 2


def test_rows_that_were_driven_are_judged_anew_by_the_command(tmp_path, capsys):
    rows = tmp_path / "trials.parquet"
    _table(_trials(), _trials(outcome=_ending(16, "collided"))).to_parquet(rows)
    asked = ["nav2-gate", "base", "head", "--controllers", "rpp", "--rows", str(rows)]
    assert main(asked) == 1
    shown = capsys.readouterr()
    assert shown.out.startswith("# Nav2 gate: red\n")
    assert shown.err.startswith("regression: doorway, rpp: touch_rate worse: 0 -> 25 %")
    _table(_trials(), _trials()).to_parquet(rows)
    assert main(asked) == 0
    outcome = _ending(1, "error")
    _table(_trials(outcome=outcome), _trials(outcome=outcome)).to_parquet(rows)
    assert main(asked) == 2
    assert "came to no end: doorway, rpp: 1 trial ended as an error" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--trials", "8"], "--trials: expected no --rows beside it; --rows drives nothing"),
        (["--seed", "0"], "--seed: expected no --rows beside it"),
    ],
)
def test_options_of_driving_have_no_place_beside_rows(tmp_path, capsys, more, message):
    asked = ["nav2-gate", "base", "head", "--controllers", "rpp", "--rows", "x.parquet"]
    assert main([*asked, *more]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_rows_that_are_none_are_one_line(tmp_path, capsys):
    path = tmp_path / "trials.parquet"
    asked = ["nav2-gate", "base", "other", "--controllers", "rpp", "--rows", str(path)]
    for write, message in (
        (lambda: None, "cannot be read"),
        (lambda: path.write_text("no table"), "cannot be read"),
        (lambda: pd.DataFrame({"a": [1]}).to_parquet(path), "has no column 'scenario'"),
        (
            lambda: _trials().drop(columns="min_clearance_m").to_parquet(path),
            "has no column 'min_clearance_m'",
        ),
        (lambda: _table(_trials(), _trials()).to_parquet(path), "no trial of 'rpp@other'"),
    ):
        write()
        assert main(asked) == 2
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1
    assert len(read_rows(path)) == 2 * PAIRS


@pytest.mark.parametrize(
    ("controller", "column"),
    [
        ("rpp", "rpp@base"),
        ("rpp:a=0.5:b=1", "rpp@base:a=0.5:b=1"),
        ("my::Controller", "my::Controller@base"),
        ("my::Controller:speed=1", "my::Controller@base:speed=1"),
    ],
)
def test_a_column_is_the_original_of_a_variant(controller, column, build_of):
    assert column_of(controller, build_of("base")) == column


def test_two_builds_of_the_same_program_are_not_driven(tmp_path, build_of):
    base, head = build_of("base"), build_of("head")
    result = drive_gate(base, head, ["rpp"], tmp_path / "out")
    assert result.trials == 0
    assert "nothing was driven" in to_markdown(result)
    assert not (tmp_path / "out").exists()


def test_trials_that_are_all_one_count_once_and_are_told():
    same = _trials(**{metric.name: np.ones(PAIRS) for metric in all_metrics()})
    slower = same.assign(time_to_goal_s=1.5)
    result = _gate(same, slower)
    assert result.judged.one_trial_cells == (("", "doorway", "rpp"),)
    (finding,) = result.regressions
    assert (finding.comparison.pairs, finding.is_one_trial) == (1, True)
    told = "All seeds drive one and the same trial, which counts once: rpp in doorway"
    assert told in to_markdown(result)
    assert told not in to_markdown(_gate(_trials(), slower))


def test_flags_are_told_and_that_they_differ():
    result = _gate(_trials(), _trials())
    assert "lags of packages" not in to_markdown(result)
    base, head = (side._replace(flags="a -O3") for side in (BASE, HEAD))
    alike = to_markdown(result._replace(base=base, head=head))
    assert "Flags of packages: a -O3." in alike
    other = to_markdown(result._replace(base=base))
    assert "compiled with different flags**: a -O3; no more than the portable ones" in other
