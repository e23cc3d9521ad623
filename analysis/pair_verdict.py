"""The verdict on two compared columns in words: better, worse, both, or not shown.

It uses only decided findings of `paired_tests`, and of these the outcomes and the listed metrics.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.contests import ARROW, contest_of, matches_within
from drake_navbench.analysis.numbers import typeset
from drake_navbench.analysis.paired_tests import (
    SUCCESS,
    TOUCH,
    Family,
    Finding,
    Judged,
    PairedVerdict,
    in_order,
    judge_pairs,
)
from drake_navbench.kernels.percent import PERCENT

# The words for a quantity that became better or worse.
WORDS = {
    SUCCESS: "arrivals",
    TOUCH: "touches",
    "time_to_goal_s": "time to the goal",
    "min_clearance_m": "smallest clearance",
    "cross_track_error_mean_m": "distance from the plan",
    "heading_error_mean_deg": "heading error",
    "jerk_rms_mps3": "jerk",
    "angular_jerk_rms_radps3": "turning jerk",
    "driven_length_m": "driven length",
}
NO_DIFFERENCE = "no difference is shown"


class PairVerdict(NamedTuple):
    """The verdict on a pair of columns.

    label: the contest's. name: the pair's, "old -> new". text: one sentence. details: one sentence
    for each decided finding, losses first.
    """

    label: str
    name: str
    text: str
    details: tuple[str, ...]


def pair_verdicts(judged: Judged) -> list[PairVerdict]:
    """Returns the verdict on each pair of columns, in the order in which they were judged."""
    groups: dict[tuple[str, str], list[Finding]] = {}
    for finding in judged.findings:
        groups.setdefault((finding.label, finding.controller), []).append(finding)
    return [_verdict(label, name, found) for (label, name), found in groups.items()]


def verdicts_within(
    trials: pd.DataFrame, files: Mapping[str, Mapping[str, str]], suites: Mapping[str, str]
) -> list[PairVerdict]:
    """Returns the verdicts on the columns of one run against the first, see `matches_within`."""
    matches = matches_within(list(dict.fromkeys(trials["controller"])), files)
    return pair_verdicts(judge_pairs([contest_of(trials, trials, matches, suites)]))


def _verdict(label: str, name: str, findings: Sequence[Finding]) -> PairVerdict:
    told = [f for f in findings if f.quantity.family is not Family.OTHERS]
    better = in_order(f for f in told if f.verdict is PairedVerdict.BETTER)
    worse = in_order(f for f in told if f.verdict is PairedVerdict.WORSE)
    old, arrow, new = name.partition(ARROW)
    if not arrow:
        old, new = "before", label or "after"
    subject = f"{name}: {new}" if not arrow else new
    if all(f.verdict in (PairedVerdict.EQUAL, PairedVerdict.NO_VALUE) for f in findings):
        text = f"{subject} drives exactly like {old} in every trial"
    elif better and worse:
        text = f"{subject} is better than {old} in {_named(better)}, and worse in {_named(worse)}"
    elif better:
        text = (
            f"{subject} is better than {old}, in {_named(better)}, and is not shown to be "
            f"worse in anything"
        )
    elif worse:
        text = f"{subject} is worse than {old}, in {_named(worse)}"
    else:
        text = f"{NO_DIFFERENCE} between {old} and {new}{_needed(told)}"
        text = f"{name}: {text}" if not arrow else text
    return PairVerdict(label, name, f"{text}.", tuple(map(finding_words, [*worse, *better])))


def finding_words(finding: Finding) -> str:
    """Returns a finding as a short sentence with its numbers."""
    quantity, found = finding.quantity, finding.comparison
    word = WORDS.get(quantity.name, quantity.name)
    where = finding.scenario
    if quantity.family is Family.OUTCOMES:
        counts = (_count(mean, found.pairs) for mean in (finding.base_mean, finding.head_mean))
        change = f"{' -> '.join(counts)} of {found.pairs}"
    else:
        low, high = found.interval
        unit = typeset(quantity.unit)
        change = f"{finding.base_mean:.3g} -> {finding.head_mean:.3g} {unit}".rstrip()
        if low == low:  # No interval where there is one trial.
            change += f" ({found.difference:+.2g}, 95% {low:+.2g} to {high:+.2g})"
    return f"{word} {finding.verdict} in {where}: {change}"


def _count(percent: float, pairs: int) -> str:
    return f"{percent / PERCENT * pairs:.0f}"


def _named(findings: Sequence[Finding]) -> str:
    names = dict.fromkeys(WORDS.get(f.quantity.name, f.quantity.name) for f in findings)
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def _needed(findings: Sequence[Finding]) -> str:
    """Returns the largest undecided difference, and the number of pairs that would decide it."""
    open_ones = in_order(f for f in findings if f.verdict is PairedVerdict.UNDECIDED)
    if not open_ones:
        return ": what differs is too small to matter"
    finding = open_ones[0]
    quantity, found = finding.quantity, finding.comparison
    word = WORDS.get(quantity.name, quantity.name)
    pairs = "1 pair" if found.pairs == 1 else f"{found.pairs} pairs"
    if quantity.family is Family.OUTCOMES:
        counts = (_count(mean, found.pairs) for mean in (finding.base_mean, finding.head_mean))
        text = f" in {pairs} ({word} {' -> '.join(counts)}"
    else:
        unit = typeset(quantity.unit)
        means = f"{finding.base_mean:.3g} -> {finding.head_mean:.3g}"
        text = f" in {pairs} ({word} {means} {unit}".rstrip()
    if (needed := finding.trials_needed) is None:
        return f"{text})"
    # A test of ranks needs at least this many pairs, whatever their spread.
    return f"{text}; about {max(needed, finding.fewest_differing)} pairs would decide)"
