"""How often verdicts are wrong, and how often they are found: by simulation, printed with -s.

The figures stand in docs/ci.md.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from paired_tables import METRICS, Law, draw

from drake_navbench.analysis.paired_tests import ALARM_RATE, Judged, PairedVerdict, judge_pairs
from drake_navbench.analysis.paired_trials import Contest
from drake_navbench.studies.side_by_side.gate import GateResult, Light, Side

pytestmark = pytest.mark.long

USUAL = Law(aborts=0.02, touches=0.01)
# As of a real campaign: most arrive, some seldom.
MIXED = [USUAL, Law(aborts=0.3, touches=0.1), Law(), Law(), Law(), Law(aborts=0.03)] * 2
TOLD = (PairedVerdict.WORSE, PairedVerdict.BETTER, PairedVerdict.CHANGED, PairedVerdict.SMALL)


def simulated(
    runs: int,
    pairs: int,
    before: list[Law],
    after: list[Law],
    is_told: Callable[[Judged], bool],
    *,
    metrics: int = len(METRICS),
) -> float:
    """Returns the share of runs of which something is told."""
    chosen = METRICS[:metrics]
    names = [metric.name for metric in chosen]
    told = 0
    for run in range(runs):
        tables = [
            draw(np.random.default_rng((run, side)), laws, pairs, names)
            for side, laws in enumerate((before, after))
        ]
        told += is_told(judge_pairs([Contest(*tables)], metrics=chosen))
    return told / runs


def light(judged: Judged) -> Light:
    return GateResult(Side("base"), Side("head"), judged=judged).light


def is_red(judged: Judged) -> bool:
    return light(judged) is Light.RED


def has_any_verdict(judged: Judged) -> bool:
    return any(finding.verdict in TOLD for finding in judged.findings)


def is_worse(judged: Judged) -> bool:
    return bool(judged.of(PairedVerdict.WORSE))


@pytest.mark.parametrize(("name", "runs", "pairs"), [("compare", 100, 16), ("gate", 40, 64)])
def test_equal_laws_are_told_apart_in_few_runs(name, runs, pairs):
    share = simulated(runs, pairs, MIXED, MIXED, has_any_verdict)
    print(f"{name}: equal in law, {len(MIXED)} cells, {pairs} trials: any verdict {share:.1%}")
    assert share <= ALARM_RATE


@pytest.mark.parametrize("aborts", [0.03, 0.3])
def test_outcomes_of_equal_laws_are_told_apart_in_few_runs(aborts):
    laws = [Law(aborts=aborts)] * 120
    share = simulated(100, 16, laws, laws, has_any_verdict, metrics=0)
    print(f"compare: 120 cells that abort in {aborts:.0%}: any verdict {share:.1%}")
    assert share <= ALARM_RATE


def test_equal_laws_that_crash_are_not_red():
    laws = [Law(errors=0.1)] * 12
    share = simulated(200, 64, laws, laws, is_red, metrics=0)
    print(f"gate: equal in law, 10% of trials end as errors: red {share:.1%}")
    assert share <= ALARM_RATE


@pytest.mark.parametrize(
    ("what", "law", "pairs"),
    [
        ("touches in a quarter", Law(touches=0.25), 64),
        ("ends as an error in a sixteenth", Law(errors=1 / 16), 64),
        ("aborts in a quarter", Law(aborts=0.25), 64),
    ],
)
def test_a_head_that_fails_is_red(what, law, pairs):
    before = [Law(), *MIXED[1:]]
    share = simulated(300, pairs, before, [law, *MIXED[1:]], is_red, metrics=0)
    print(f"gate: {what} of {pairs} trials: red {share:.1%}")
    assert share >= 0.95


@pytest.mark.parametrize(
    ("what", "law", "pairs", "least"),
    [
        ("touches in a half", Law(touches=0.5), 16, 0.5),
        ("touches in three quarters", Law(touches=0.75), 16, 0.95),
        ("touches in a quarter", Law(touches=0.25), 32, 0.4),
    ],
)
def test_compare_finds_losses_of_this_size(what, law, pairs, least):
    before = [Law(), *MIXED[1:]]
    share = simulated(300, pairs, before, [law, *MIXED[1:]], is_worse, metrics=0)
    print(f"compare: {what} of {pairs} trials: worse {share:.1%}")
    assert share >= least


@pytest.mark.parametrize(("shift", "pairs", "least"), [(2.0, 16, 0.7), (1.0, 64, 0.9)])
def test_metrics_that_shift_are_found(shift, pairs, least):
    laws = [Law(shift=shift), *[Law()] * 11]
    share = simulated(40, pairs, [Law()] * 12, laws, has_any_verdict, metrics=20)
    print(f"metrics shifted by {shift:g} sd, {pairs} trials: told {share:.1%}")
    assert share >= least
