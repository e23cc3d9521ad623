"""A change to try on the robot, where no change is shown to help."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.judged import Judged
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import IDLE, Tried


class Kind(StrEnum):
    """The evidence for an offer."""

    TRADE = "trade"
    HELPED = "helped"
    READ = "read"


@dataclass(frozen=True)
class Offer:
    """A change to try. judged: its trials; None if none was driven, as where none depends on it.

    symptom: the one that it is for.
    """

    kind: Kind
    tried: Tried
    trial: Trial
    symptom: Symptom
    judged: Judged | None = None

    @property
    def is_idle(self) -> bool:
        """Whether no trial depends on the change."""
        return self.tried.reason == IDLE
