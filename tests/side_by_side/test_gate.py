"""The gate: what it calls worse, how often it may be wrong, and what it says."""

from __future__ import annotations

import math
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.statistics import trials_needed
from drake_navbench.side_by_side.gate import (
    ALARM_RATE,
    GateResult,
    Verdict,
    column_of,
    detectable_difference,
    drive_gate,
    judge_trials,
    repeated_cells,
)
from drake_navbench.side_by_side.gate_report import to_junit, to_markdown

PAIRS = 64


def _trials(**values) -> pd.DataFrame:
    """Returns PAIRS trials of one controller; a metric that is not given is 1 in all."""
    rows = {metric.name: np.ones(PAIRS) for metric in all_metrics()}
    identity = {"scenario": "doorway", "controller": "rpp", "seed": range(PAIRS)}
    return pd.DataFrame(identity | rows | values)


def _verdicts(before: pd.DataFrame, after: pd.DataFrame) -> dict[str, Verdict]:
    findings, _ = judge_trials(before, after)
    return {finding.metric.name: finding.verdict for finding in findings}


def _result(build_of, before: pd.DataFrame, after: pd.DataFrame) -> GateResult:
    findings, equal = judge_trials(before, after)
    base, head = build_of("base"), build_of("head", "/head")
    folder = base.checkout
    return GateResult(
        base, head, ("doorway",), PAIRS, tuple(findings), equal, folder, pd.DataFrame()
    )


def test_equal_trials_are_the_same_in_everything():
    findings, equal = judge_trials(_trials(), _trials())
    assert equal == (PAIRS, PAIRS)
    assert {finding.verdict for finding in findings} == {Verdict.SAME}
    assert {finding.p_value for finding in findings} == {1.0}


def test_what_depends_on_the_machine_or_has_no_good_direction_is_no_test():
    slow = _trials(compute_time_p95_ms=np.full(PAIRS, 9.0), duration_s=np.full(PAIRS, 9.0))
    assert set(_verdicts(_trials(), slow).values()) == {Verdict.SAME}


@pytest.mark.parametrize(
    ("metric", "value", "verdict"),
    [
        ("time_to_goal_s", 1.5, Verdict.WORSE),
        ("time_to_goal_s", 0.5, Verdict.BETTER),
        ("min_clearance_m", 0.5, Verdict.WORSE),
        ("min_clearance_m", 1.5, Verdict.BETTER),
        ("time_to_goal_s", 1.005, Verdict.SMALL),
    ],
)
def test_a_change_of_every_pair_is_judged_by_its_direction_and_size(metric, value, verdict):
    changed = _trials(**{metric: np.full(PAIRS, value)})
    assert _verdicts(_trials(), changed)[metric] is verdict


@pytest.mark.parametrize(("lost", "verdict"), [(20, Verdict.WORSE), (5, Verdict.UNDECIDED)])
def test_lost_successes_count_by_the_exact_sign_test(lost, verdict):
    # 20 of 20 changed pairs one way: 2^-19; 5 of 5: 2^-4. Corrected for some 60 tests.
    after = _trials(success_rate=np.where(np.arange(PAIRS) < lost, 0.0, 1.0))
    findings, _ = judge_trials(_trials(), after)
    (success,) = (finding for finding in findings if finding.metric.name == "success_rate")
    assert success.verdict is verdict
    assert success.p_value == pytest.approx(min(len(findings) * 2.0 ** (1 - lost), 1.0))


def test_noise_alone_raises_an_alarm_in_few_of_many_changes():
    # Both sides of each of 60 changes are drawn alike; the correction promises one in a hundred.
    random = np.random.default_rng(1)
    names = [metric.name for metric in all_metrics()][:20]
    alarms = 0
    for _ in range(60):
        sides = [_trials(**{n: random.normal(1.0, 0.3, PAIRS) for n in names}) for _ in range(2)]
        verdicts = _verdicts(*sides).values()
        alarms += any(verdict in (Verdict.WORSE, Verdict.BETTER) for verdict in verdicts)
    # Binomially, more than four of 60 happen once in 3000 times at this rate.
    assert alarms <= 4


def test_what_could_be_seen_is_what_so_many_pairs_are_needed_for():
    seen = detectable_difference(2.0, PAIRS, 0.01)
    needed = trials_needed(2.0, seen, confidence=0.99)
    assert needed == pytest.approx(PAIRS, abs=2)
    assert math.isnan(detectable_difference(2.0, 1, 0.01))


def test_a_red_gate_says_what_became_worse(build_of):
    result = _result(build_of, _trials(), _trials(time_to_goal_s=np.full(PAIRS, 1.5)))
    text = to_markdown(result)
    assert text.startswith("# Nav2 gate: red\n")
    assert "`base`, Nav2 jazzy 1.3.7 at abc" in text
    assert "| doorway | rpp | time_to_goal_s [s] | 1 | 1.5 | +0.5 | 64 |" in text
    assert f"{ALARM_RATE:.0%} of changes" in text
    suite = ElementTree.fromstring(to_junit(result))[0]
    assert suite.get("failures") == "1"
    (failed,) = suite.iterfind("testcase/failure/..")
    assert (failed.get("classname"), failed.get("name")) == ("doorway.rpp", "time_to_goal_s")


def test_a_green_gate_says_what_it_would_have_seen(build_of):
    random = np.random.default_rng(2)
    noisy = _trials(time_to_goal_s=random.normal(1.0, 0.1, PAIRS))
    result = _result(build_of, _trials(), noisy)
    (finding,) = (f for f in result.findings if f.metric.name == "time_to_goal_s")
    text = to_markdown(result)
    assert text.startswith("# Nav2 gate: green\n")
    assert f"{finding.detectable:.2g}" in text.partition("What would have been seen")[2]
    assert ElementTree.fromstring(to_junit(result))[0].get("failures") == "0"


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


@pytest.mark.parametrize(("trials", "is_told"), [(12, True), (20, False)])
def test_too_few_trials_for_any_alarm_are_told(trials, is_told, build_of):
    # Some 60 tests: 60 * 2^-11 is above 0.01, 60 * 2^-19 below.
    result = _result(build_of, _trials(), _trials())._replace(trials=trials)
    assert ("too few for any alarm" in to_markdown(result)) is is_told


def test_two_builds_of_the_same_program_are_not_driven(tmp_path, build_of):
    base, head = build_of("base"), build_of("head")
    result = drive_gate(base, head, ["rpp"], tmp_path / "out")
    assert result.trials == 0
    assert "nothing was driven" in to_markdown(result)
    assert not (tmp_path / "out").exists()


def test_trials_that_are_all_one_are_told(build_of):
    noisy = _trials(time_to_goal_s=np.linspace(1.0, 1.1, PAIRS))
    same = _trials(time_to_goal_s=np.full(PAIRS, 1.5))
    assert repeated_cells(_trials(), same) == (("doorway", "rpp"),)
    assert repeated_cells(_trials(), noisy) == ()
    assert repeated_cells(noisy, _trials()) == ()
    assert repeated_cells(_trials()[:1], same[:1]) == ()
    told = "All seeds drive one and the same trial, so that nothing is told of chance: rpp in doorw"
    result = _result(build_of, _trials(), same)
    assert told not in to_markdown(result)
    assert told in to_markdown(result._replace(repeated=(("doorway", "rpp"),)))


def test_flags_are_told_and_that_they_differ(build_of):
    result = _result(build_of, _trials(), _trials())
    assert "lags of packages" not in to_markdown(result)
    base, head = (build.model_copy(update={"more_flags": "a -O3"}) for build in result[:2])
    alike = to_markdown(result._replace(base=base, head=head))
    assert "Flags of packages: a -O3." in alike
    other = to_markdown(result._replace(base=base))
    assert "compiled with different flags**: a -O3; no more than the portable ones" in other
