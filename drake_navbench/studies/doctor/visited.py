"""The findings of a visit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.doctor.alike import Alike
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.driving import Row, probe_of
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.first_look import Look
from drake_navbench.studies.doctor.judged import Judged, best_of
from drake_navbench.studies.doctor.offer import Offer
from drake_navbench.studies.doctor.reading import Suspicion
from drake_navbench.studies.doctor.rules.rule import Finding
from drake_navbench.studies.doctor.surroundings import Surroundings
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import Rarity, Tried, Verdict


@dataclass
class Visit:
    """The findings of a visit, or of the part of it that the budget allowed.

    seen: by symptom, the probes that show it in at least half of their seeds. told: the likeliest
    classes of the user's words, where no symptom was asked for. treated: the symptom whose causes
    were tried; None if none was seen. rare: symptoms that are too rare to try causes; if all are,
    the first is called treated. bar: severity from which on a trial counts as showing it; below 1
    the sign is weak. suspicions: of the treated symptom. of_complaint: of the one that was asked
    for, or that the words tell and no probe shows. alike: the complaints that the user is asked
    about. offers: the changes to try where none is shown to help. around: the user's map, base and
    computer. proposed: the user's own changes, tried before
    all. seed: of the first look, of which `look` tells how much was driven.
    """

    facts: Facts
    findings: list[Finding] = field(default_factory=list)
    rows: list[Row] = field(default_factory=list)
    seen: dict[Symptom, list[str]] = field(default_factory=dict)
    asked: Symptom | None = None
    told: Sequence[Symptom] = ()
    treated: Symptom | None = None
    rare: dict[Symptom, Rarity] = field(default_factory=dict)
    bar: float = 1.0
    suspicions: list[Suspicion] = field(default_factory=list)
    of_complaint: list[Suspicion] = field(default_factory=list)
    alike: list[Alike] = field(default_factory=list)
    tried: list[Tried] = field(default_factory=list)
    judged: list[Judged] = field(default_factory=list)
    offers: list[Offer] = field(default_factory=list)
    probes: Mapping[str, Scenario] = field(default_factory=dict)
    around: Surroundings = field(default_factory=Surroundings)
    proposed: Sequence[Trial] = ()
    seed: int = 0
    look: Look = field(default_factory=lambda: Look([]))
    is_out_of_time: bool = False
    is_interrupted: bool = False

    @property
    def complaint(self) -> Symptom | None:
        """The symptom that was asked for, else the likeliest class of the user's words."""
        return self.asked or next(iter(self.told), None)

    @property
    def undriven(self) -> list[str]:
        """The probes for which the first look had no time."""
        driven = {probe_of(row) for row in self.rows}
        return [name for name in self.probes if name not in driven] if self.look.lacking else []

    @property
    def cure(self) -> Judged | None:
        """The helping change that leaves the fewest symptoms; None if no change helps."""
        return best_of(self.judged)

    @property
    def shown(self) -> list[Tried]:
        """The causes that were shown, the likeliest first; what fresh seeds refute comes last.

        Of those that take the symptom away the likeliest by reading, whichever change is offered:
        with the right value a drive may go on and meet what the fault has hidden.
        """
        found = [entry for entry in self.tried if entry.verdict is Verdict.SHOWN]
        return sorted(found, key=self.is_refuted)

    @property
    def rivals(self) -> list[Tried]:
        """The causes that driving cannot tell from the likeliest: each takes the symptom away.

        Of other parameters than that one's; none if it leaves some of the symptom.
        """
        able = [e for e in self.shown if e.takes_all and e.trial and not self.is_refuted(e)]
        if not able or able[0] is not self.shown[0]:
            return []
        own = able[0].trial
        return [e for e in able[1:] if own and e.trial and not {*own.changes} & {*e.trial.changes}]

    def is_refuted(self, entry: Tried) -> bool:
        """Tells whether a change that was shown leaves the symptom on fresh seeds."""
        own = (j for j in self.judged if j.tried is entry)
        return any(not (j.is_gone or j.is_rare) for j in own)
