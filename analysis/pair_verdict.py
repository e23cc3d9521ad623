"""The verdict on two compared columns in words: better, worse, both, or not shown.

"Better" and "worse" rest on decided findings of `paired_tests` in scenarios where a trial arrived.
Losses are told whatever family they are of. Further clauses name errors, more touches and fewer
arrivals that so few trials do not decide, and decided differences where neither column arrives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.contests import ARROW, contest_of, matches_within
from drake_navbench.analysis.metrics.registry import unrepeatable_names
from drake_navbench.analysis.numbers import counted, typeset
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
# The most metrics that are not listed, which a verdict names and tells in detail.
MOST_NAMED = 2
DECIDED = (PairedVerdict.WORSE, PairedVerdict.BETTER, PairedVerdict.CHANGED)


class PairVerdict(NamedTuple):
    """The verdict on a pair of columns.

    label: the contest's. name: the pair's, "old -> new". text: one sentence. details: one sentence
    for each decided finding, losses first.
    """

    label: str
    name: str
    text: str
    details: tuple[str, ...]


class _Pair(NamedTuple):
    """The tests of a pair of columns. told: the findings of scenarios in which a trial arrived.

    in_vain: decided findings of metrics in scenarios in which neither column arrived, where who
    stands still keeps the largest clearance. Compute times are in neither: they depend on the
    machine. errors: the number of pairs in which the new column alone ended as an error.
    """

    old: str
    new: str
    told: tuple[Finding, ...]
    in_vain: tuple[Finding, ...]
    errors: int

    def of(self, verdict: PairedVerdict) -> list[Finding]:
        return in_order(f for f in self.told if f.verdict is verdict)

    @property
    def main(self) -> list[Finding]:
        """The outcomes and listed metrics among `told`."""
        return [f for f in self.told if f.quantity.family is not Family.OTHERS]

    @property
    def pairs(self) -> int:
        """The number of pairs of trials, those with errors included."""
        return sum(f.comparison.pairs for f in self.told if f.quantity.name == SUCCESS)


def pair_verdicts(judged: Judged) -> list[PairVerdict]:
    """Returns the verdict on each pair of columns, in the order in which they were judged."""
    groups: dict[tuple[str, str], list[Finding]] = {}
    for finding in judged.findings:
        groups.setdefault((finding.label, finding.controller), []).append(finding)
    return [_verdict(judged, label, name, found) for (label, name), found in groups.items()]


def verdicts_within(
    trials: pd.DataFrame, files: Mapping[str, Mapping[str, str]], suites: Mapping[str, str]
) -> list[PairVerdict]:
    """Returns the verdicts on the columns of one run against the first, see `matches_within`."""
    matches = matches_within(list(dict.fromkeys(trials["controller"])), files)
    return pair_verdicts(judge_pairs([contest_of(trials, trials, matches, suites)]))


def _verdict(judged: Judged, label: str, name: str, findings: Sequence[Finding]) -> PairVerdict:
    pair = _pair_of(judged, label, name, findings)
    better, worse = pair.of(PairedVerdict.BETTER), pair.of(PairedVerdict.WORSE)
    # Every loss is told; of gains those in listed metrics, if there are such, or if any is lost.
    better = [f for f in better if f in pair.main] or ([] if worse else better)
    old, new = pair.old, pair.new
    prefix = "" if ARROW in name else f"{name}: "
    cells = {finding[:3] for finding in findings}
    has_ended = any(f.comparison.pairs for f in findings if f.quantity.name == TOUCH)
    if not (has_ended or better or worse):
        text = f"nothing is compared between {old} and {new}: in every pair a trial ended "
        text += "as an error"
    elif cells <= set(judged.equal_cells):
        text = f"{new} drives exactly like {old} in every trial"
    elif better and worse:
        text = f"{new} is better than {old} in {_named(better)}, and worse in {_named(worse)}"
    elif better:
        text = f"{new} is better than {old}, in {_named(better)}, and is not shown to be "
        text += "worse in anything"
    elif worse:
        text = f"{new} is worse than {old}, in {_named(worse)}"
    elif changed := pair.of(PairedVerdict.CHANGED):
        text = f"{new} is neither better nor worse than {old}; changed: {_named(changed)}"
    else:
        text = _nothing_shown(pair)
    text = "; ".join([f"{prefix}{text}", *_reservations(pair, is_better=bool(better))])
    in_vain = [f for f in in_order(pair.in_vain) if f.quantity.family is Family.LISTED]
    details = [*_first_ones(worse), *_first_ones(better), *in_vain]
    return PairVerdict(label, name, f"{text}.", tuple(map(finding_words, details)))


def _pair_of(judged: Judged, label: str, name: str, findings: Sequence[Finding]) -> _Pair:
    old, arrow, new = name.partition(ARROW)
    if not arrow:
        old, new = "before", label or "after"
    arrived = {
        f.scenario
        for f in findings
        if f.quantity.name == SUCCESS and max(f.base_mean, f.head_mean) > 0.0
    }
    measured = set(unrepeatable_names())
    own = [f for f in findings if f.quantity.name not in measured]
    is_told = [f.scenario in arrived or f.quantity.family is Family.OUTCOMES for f in own]
    errors = (
        trial
        for trial in judged.lost
        if (trial.label, trial.controller) == (label, name) and trial.is_new
    )
    return _Pair(
        old,
        new,
        tuple(f for f, told in zip(own, is_told, strict=True) if told),
        tuple(f for f, told in zip(own, is_told, strict=True) if not told and f.verdict in DECIDED),
        sum(not trial.is_missing for trial in errors),
    )


def _reservations(pair: _Pair, *, is_better: bool) -> list[str]:
    """Returns clauses on everything that speaks against the new column and is no decided test."""
    clauses = []
    if pair.errors:
        clauses.append(f"{pair.new} alone ended as an error in {counted(pair.errors, 'pair')}")
    # Where nothing is shown, the largest undecided difference stands in the verdict itself.
    losses = [
        f"{_word(f)} {_counts(f)} of {f.comparison.pairs} in {f.scenario}"
        for f in in_order(pair.main)
        if is_better
        and f.quantity.family is Family.OUTCOMES
        and f.verdict is PairedVerdict.UNDECIDED
        and f.is_loss
    ]
    if losses:
        clauses.append(f"too few to decide: {', '.join(losses)}")
    if pair.in_vain:
        places = ", ".join(dict.fromkeys(f.scenario for f in pair.in_vain))
        clauses.append(f"neither arrives in {places}, where {_named(pair.in_vain)} changed")
    return clauses


def _first_ones(findings: Sequence[Finding]) -> list[Finding]:
    """Returns the outcomes and listed metrics, of other metrics the most certain ones."""
    others = [f for f in findings if f.quantity.family is Family.OTHERS]
    return [f for f in findings if f not in others[MOST_NAMED:]]


def finding_words(finding: Finding) -> str:
    """Returns a finding as a short sentence with its numbers."""
    quantity, found = finding.quantity, finding.comparison
    where = finding.scenario
    if quantity.family is Family.OUTCOMES:
        change = f"{_counts(finding)} of {found.pairs}"
    else:
        low, high = found.interval
        unit = typeset(quantity.unit)
        change = f"{finding.base_mean:.3g} -> {finding.head_mean:.3g} {unit}".rstrip()
        if low == low:  # No interval where there is one trial.
            by_ranks = "; the ranks decide, as a few pairs make the mean unsure"
            doubt = by_ranks if finding.verdict in DECIDED and low <= 0.0 <= high else ""
            change += f" ({found.difference:+.2g}, 95% {low:+.2g} to {high:+.2g}{doubt})"
    return f"{_word(finding)} {finding.verdict} in {where}: {change}"


def _counts(finding: Finding) -> str:
    """Returns the numbers of pairs with an outcome, "20 -> 17"."""
    means, pairs = (finding.base_mean, finding.head_mean), finding.comparison.pairs
    return ARROW.join(f"{mean / PERCENT * pairs:.0f}" for mean in means)


def _word(finding: Finding) -> str:
    return WORDS.get(finding.quantity.name, finding.quantity.name)


def _named(findings: Sequence[Finding]) -> str:
    """Returns the names of quantities; of metrics that are not listed the number, if many."""
    others = [f for f in findings if f.quantity.family is Family.OTHERS]
    names = list(dict.fromkeys(_word(f) for f in findings if f not in others))
    own = list(dict.fromkeys(map(_word, others)))
    names += own if len(own) <= MOST_NAMED else [f"{len(own)} {'other ' * bool(names)}metrics"]
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def _nothing_shown(pair: _Pair) -> str:
    """Returns the largest undecided difference, and the number of pairs that would decide it.

    Without one, why there is none: nothing matters, or the pairs differ where neither arrives.
    """
    text = f"{NO_DIFFERENCE} between {pair.old} and {pair.new}"
    open_ones = in_order(f for f in pair.main if f.verdict is PairedVerdict.UNDECIDED)
    if not open_ones:
        small = any(f.verdict is PairedVerdict.SMALL for f in pair.told)
        undecided = [f for f in pair.told if f.verdict is PairedVerdict.UNDECIDED]
        if small or undecided:
            return text + (": what differs is too small to matter" if small else _among(undecided))
        where = "" if pair.in_vain else ": they differ only where they do not arrive"
        return f"{text} in {counted(pair.pairs, 'pair')}{where}"
    finding = open_ones[0]
    quantity, found = finding.quantity, finding.comparison
    pairs = counted(found.pairs, "pair")
    text = f"{text} in {pairs}"
    if all(f.comparison.pairs < f.fewest_differing and not f.is_one_trial for f in pair.told):
        few = "is" if found.pairs == 1 else "are"
        text = f"{pairs} {few} too few to show a difference between {pair.old} and {pair.new}"
    if quantity.family is Family.OUTCOMES:
        change = _counts(finding)
    else:
        unit = typeset(quantity.unit)
        change = f"{finding.base_mean:.3g} -> {finding.head_mean:.3g} {unit}".rstrip()
    if len({f.scenario for f in pair.told}) > 1:
        change += f" in {finding.scenario}"
    text += f" ({_word(finding)} {change}"
    if (needed := finding.trials_needed) is None:
        return f"{text})"
    # A test of ranks needs at least this many pairs, whatever their spread.
    return f"{text}; about {max(needed, finding.fewest_differing)} pairs would decide)"


def _among(undecided: Sequence[Finding]) -> str:
    return f"; {_named(in_order(undecided))} undecided"
