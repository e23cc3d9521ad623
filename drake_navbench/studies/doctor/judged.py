"""A change on fresh seeds: in how many trials it shows each symptom, and whether it helps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.race import CHANCE
from drake_navbench.studies.doctor.symptoms import Symptom, is_lighter
from drake_navbench.studies.doctor.tried import Tried

# If fewer trials than this show the symptom before the change, none is judged.
LEAST_SHOWN = 3


class Again(NamedTuple):
    """Trials that look for one further touch again; those with a touch, before and after."""

    trials: int
    before: int
    after: int


@dataclass(frozen=True)
class Judged:
    """A change on fresh seeds. before, after: in how many trials each symptom is shown.

    Trials that a touch or another of CUTS_SHORT ends before the change may miss what would follow:
    most symptoms are compared over the rest, `compared`; ENDS and the treated symptom over all but
    those with a touch; touches over all. before_target, after_target: likewise of the symptom, in
    the probes that showed it, `showing`. instead: by symptom, in how many of the trials that are
    not compared it is shown now. best: index of the trial of these probes in which the symptom
    falls most. symptom: the one that the change is for. fails: whether the program failed in a
    trial with the change, but not without. lacking: the trials for which there was no time.
    undriven: the probes without a trial for want of time. same: the trials that stay the same to
    the last digit. before_mean, after_mean: mean severity of the symptom in these probes. again:
    whether one further touch came again; None if there was none, or no time.
    """

    tried: Tried
    trial: Trial
    trials: int
    compared: int
    before: Mapping[str, int]
    after: Mapping[str, int]
    before_target: int
    after_target: int
    target_trials: int
    instead: Mapping[str, int]
    showing: tuple[str, ...] = ()
    best: int = 0
    symptom: Symptom | None = None
    fails: bool = False
    lacking: int = 0
    undriven: tuple[str, ...] = ()
    same: int = 0
    before_mean: float = 0.0
    after_mean: float = 0.0
    again: Again | None = None

    @property
    def worse(self) -> list[str]:
        """The symptoms that more trials show than before, a touch first."""
        found = []
        is_chance = self.again is not None and self.again.after <= self.again.before
        for name in self.before:
            allowed = CHANCE if name != Symptom.COLLISION or is_chance else 0
            if self.after[name] > self.before[name] + allowed:
                found.append(name)
        return sorted(found, key=lambda name: name != Symptom.COLLISION)

    @property
    def left(self) -> int:
        """The number of symptoms that the trials show with the change, all together."""
        return sum(self.after.values())

    @property
    def helps(self) -> bool:
        """Whether the symptom is gone or rare, and each one that comes is lighter.

        A robot that now comes farther meets what it did not meet before.
        """
        if self.fails or not self.is_gone or self.symptom is None:
            return False
        return all(is_lighter(Symptom(name), self.symptom) for name in self.worse)

    @property
    def has_one_touch_more(self) -> bool:
        """Whether one further touch, of all trials, is all that speaks against the change."""
        more = self.after[Symptom.COLLISION] - self.before[Symptom.COLLISION]
        without = replace(self, after={**self.after, Symptom.COLLISION: 0})
        return more == 1 and not self.helps and without.helps

    @property
    def is_trade(self) -> bool:
        """Whether the symptom is gone, but others have come, none of which is a touch."""
        is_cure = self.is_gone and not self.fails and not self.helps
        return is_cure and Symptom.COLLISION not in self.worse

    @property
    def is_rare(self) -> bool:
        """Whether too few trials show the symptom before the change to judge one."""
        return self.before_target < LEAST_SHOWN

    @property
    def is_gone(self) -> bool:
        """Whether at most half as many trials show the symptom, of enough to tell."""
        return not self.is_rare and self.after_target <= self.before_target // 2


def best_of(judged: Sequence[Judged]) -> Judged | None:
    """Returns the helping change that brings the fewest other symptoms; None if no change helps.

    Of several the one that leaves the fewest symptoms; a difference that may be chance is none, and
    then the likelier cause stays first. A judgement that lacks trials may seem to leave fewer, so
    it comes last.
    """
    helping = [entry for entry in judged if entry.helps]
    helping = [entry for entry in helping if not entry.lacking] or helping
    fewest = min((len(entry.worse) for entry in helping), default=0)
    able = [entry for entry in helping if len(entry.worse) == fewest]
    left = min((entry.left for entry in able), default=0)
    return next((entry for entry in able if entry.left <= left + CHANCE), None)
