"""The one thing to do next after a visit that offers no change."""

from __future__ import annotations

from collections.abc import Sequence

from drake_navbench.studies.doctor.causes import with_short_outlines
from drake_navbench.studies.doctor.change_words import cause_told, change_told
from drake_navbench.studies.doctor.cures import told_with_step
from drake_navbench.studies.doctor.far_values import FAR
from drake_navbench.studies.doctor.labels import patch_name
from drake_navbench.studies.doctor.offer import Kind
from drake_navbench.studies.doctor.rules.rule import Finding
from drake_navbench.studies.doctor.told import told_cures
from drake_navbench.studies.doctor.visited import Visit
from drake_navbench.studies.doctor.words import is_unfinished


def next_step(visit: Visit) -> str:
    """Returns the one thing to do next where no change is offered; '' where one is."""
    if visit.cure is not None:
        return ""
    if is_unfinished(visit) or visit.look.lacking:
        return "Next: give the same command again; it goes on where the time ended."
    proven = [f for f in visit.findings if not f.rule.name.startswith(FAR)]
    if visit.offers:
        return " ".join([_first_offer(visit), *_also(visit, proven)])
    if proven:
        told = with_short_outlines(told_cures(proven[0], visit.facts))
        return f"Next: mend what the file itself shows: {told}."
    if visit.shown:
        return f"Next: weigh the price of {cause_told(visit.shown[0])}; the table has it."
    if visit.of_complaint or visit.suspicions:
        first = (visit.of_complaint or visit.suspicions)[0].cause
        return f"Next, on the robot: {told_with_step(first, visit.facts)}, and nothing else."
    return "Next: tell what you see on the robot, by --symptom or --told." * (not visit.seen)


def _first_offer(visit: Visit) -> str:
    first = visit.offers[0]
    if first.kind is Kind.TRADE:
        return f"Next: weigh the price of {patch_name(1)} ({change_told(first.trial)})."
    return f"Next, on the robot: {patch_name(1)} ({change_told(first.trial)}), and nothing else."


def _also(visit: Visit, proven: Sequence[Finding]) -> list[str]:
    """Returns a sentence on what the file itself shows, if that is not what is offered first."""
    if not proven or visit.offers[0].tried.suspicion.cause.key in {c.key for c in proven[0].cures}:
        return []
    told = with_short_outlines(told_cures(proven[0], visit.facts))
    return [f"The file itself shows, too: {told}."]
