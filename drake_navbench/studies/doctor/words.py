"""The verdict of a visit in plain words, for the terminal and the page."""

from __future__ import annotations

from collections.abc import Sequence

from drake_navbench.analysis.numbers import counted
from drake_navbench.studies.doctor.causes import Cause, with_short_outlines
from drake_navbench.studies.doctor.change_words import cause_told, change_told, name_of_place
from drake_navbench.studies.doctor.cures import Trial, told_with_step
from drake_navbench.studies.doctor.judged import Judged
from drake_navbench.studies.doctor.reading import Suspicion
from drake_navbench.studies.doctor.symptoms import LOOKS_LIKE, Symptom
from drake_navbench.studies.doctor.told import told_blindness, told_failures
from drake_navbench.studies.doctor.tried import (
    LEAST_FALL,
    LEAST_FALLS,
    MOST_PAIRS,
    NO_TIME,
    Rarity,
    Tried,
    Verdict,
)
from drake_navbench.studies.doctor.visited import Visit

MOST_NAMED = 3


def verdict(visit: Visit) -> str:
    """Returns the verdict of a visit in a few sentences, the last on what the user proposed."""
    told = [_verdict(visit).rstrip(), *_look_cut_short(visit), *_offers_told(visit)]
    complaint = visit.complaint
    if not visit.offers and (
        visit.of_complaint
        and visit.treated not in (None, complaint)
        and complaint not in visit.rare
    ):
        told.append(_first_to_try(visit, visit.of_complaint, f" for {complaint}"))
    return " ".join([*told, *(_proposal_told(visit, trial) for trial in visit.proposed)])


def _look_cut_short(visit: Visit) -> list[str]:
    """Returns a sentence on what the first look left out, if it left out anything."""
    look = visit.look
    if not look.lacking or not visit.rows:
        return []
    names = f" (not driven: {', '.join(visit.undriven)})" if visit.undriven else ""
    on = "" if is_unfinished(visit) else "; the same command goes on with the others"
    count = look.planned - look.lacking
    return [f"The first look had time for {count} of {look.planned} trials{names}{on}."]


def _offers_told(visit: Visit) -> list[str]:
    if not visit.offers:
        return []
    count, symptom = len(visit.offers), visit.offers[0].symptom
    where = f" for {symptom}" if visit.treated not in (None, symptom) else ""
    return [f"Below: {count} change{'s' * (count != 1)} to try on the robot{where}."]


def _proposal_told(visit: Visit, trial: Trial) -> str:
    entry = next((entry for entry in visit.tried if entry.trial is trial), None)
    what = "not tried" if entry is None else f"{entry.verdict} ({evidence(entry)})"
    return f"Your proposal, {change_told(trial)}: {what}."


def _verdict(visit: Visit) -> str:
    if visit.treated is None:
        return _nothing_seen(visit)
    weak = "" if visit.bar == 1.0 else f"there is a weak sign ({visit.bar:.0%} of the threshold): "
    what = f"In {_probes(visit, visit.treated)} {weak}the robot {LOOKS_LIKE[visit.treated]}."
    if visit.asked not in (None, visit.treated, *visit.rare):
        what = f"No probe shows {visit.asked}. {what}"
    if visit.asked is not None and {visit.asked, visit.treated}.isdisjoint({Symptom.COLLISION}):
        what += _touches_seen(visit)
    if visit.told and visit.seen.keys().isdisjoint(visit.told):
        what = f"No probe shows what your words may tell ({', '.join(visit.told)}). {what}"
    rare = "".join(f" {_rare_told(symptom, rarity)}" for symptom, rarity in visit.rare.items())
    if visit.treated in visit.rare:
        return f"{what}{rare} So no change was tried."
    what = f"{what}{rare}"
    cure = visit.cure
    if cure is not None:
        told = f"{_cured(cure)}{_preferred(visit.judged, cure)}{_likeliest(visit)}"
        return f"{what} {told}{_not_drivable(visit)}"
    if visit.shown:
        best = visit.shown[0]
        return (
            f"{what} In the experiment {cause_told(best)} reduces this, but the doctor found no "
            f"change that makes nothing else worse{_why_not(visit)}.{_likeliest(visit)}"
        )
    if is_unfinished(visit) and not any(entry.pairs for entry in visit.tried):
        why = "was interrupted" if visit.is_interrupted else "had no time left (--budget)"
        return (
            f"{what} The visit {why} before a cause was tried; the same command goes on. "
            f"{_first_to_try(visit, visit.suspicions)}"
        )
    cut_off = _cut_off(visit)
    if cut_off is not None:
        fall = f"from {cut_off.before:.2f} to {cut_off.after:.2f}"
        pairs = f"{cut_off.pairs} pair{'s' * (cut_off.pairs != 1)}"
        return (
            f"{what} No cause is shown yet: there was no time for more pairs. With "
            f"{cause_told(cut_off)} its severity (shown above 1) falls {fall} in {pairs}, too few "
            "to show it; the same command goes on from there."
        )
    outside = [e.suspicion.cause.told for e in visit.tried if e.verdict is Verdict.OUTSIDE]
    could = f" Also possible: {outside[0]}." if outside else ""
    ended = " There was no time to try more." if is_unfinished(visit) else ""
    undriven = _not_drivable(visit)
    return (
        f"{what} No cause found: no change that was tried removes the symptom."
        f"{undriven}{could}{ended}"
    )


def _touches_seen(visit: Visit) -> str:
    """Returns a sentence on touches beside the symptom that was asked for; '' without any."""
    if Symptom.COLLISION not in visit.seen:
        return ""
    return (
        f" Worse, it touches something in {_probes(visit, Symptom.COLLISION)}: "
        "--symptom collision treats that."
    )


def _nothing_seen(visit: Visit) -> str:
    if is_unfinished(visit):
        return "The visit ended before the probes were driven; the rules' findings stand below."
    if visit.asked is None and not visit.told:
        found = "No symptom so far" if visit.look.lacking else "Nothing to improve"
        return f"{found}: no probe shows a symptom."
    if visit.asked is None:
        return (
            "No cause found: no probe shows a symptom with this file and robot. Your words may "
            f"tell {visit.told[0]}. {_first_to_try(visit, visit.suspicions)}"
        )
    others = ", ".join(symptom.value for symptom in visit.seen)
    seen = f" The probes show {others}: give one of these to --symptom." if others else ""
    return (
        f"No cause found: no probe shows {visit.asked} with this file and robot.{seen} "
        f"{_first_to_try(visit, visit.suspicions)}"
    )


def _first_to_try(visit: Visit, suspicions: Sequence[Suspicion], where: str = "") -> str:
    """Returns a sentence on the likeliest causes by reading; '' where changes to try say more."""
    if visit.offers:
        return ""
    told = [told_with_step(s.cause, visit.facts) for s in suspicions[:MOST_NAMED]]
    told = [with_short_outlines(instruction) for instruction in told]
    return f"By the rules and by users' reports, try{where} first: {'; '.join(told)}."


def _cut_off(visit: Visit) -> Tried | None:
    """Returns the change that helps most of those for which the time was too short; None if none.

    A change that others outdid, or without effect, is none of these.
    """
    if not is_unfinished(visit):
        return None
    able = [e for e in visit.tried if e.trial and e.reason in ("", NO_TIME) and not e.touches]
    helping = [e for e in able if e.fall >= LEAST_FALL]
    return max(helping, key=lambda e: e.fall, default=None)


def is_unfinished(visit: Visit) -> bool:
    return visit.is_out_of_time or visit.is_interrupted


def _probes(visit: Visit, symptom: Symptom) -> str:
    names, driven = visit.seen[symptom], len(visit.probes) - len(visit.undriven)
    about = [visit.probes[name].description for name in names[:MOST_NAMED]]
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return f"{len(names)} of {driven} probes ({'; '.join(about)}{more})"


def _cured(cure: Judged) -> str:
    instead = ""
    if cure.instead:
        shown = ", ".join(
            f"{name} in {counted(count, 'trial')}" for name, count in cure.instead.items()
        )
        instead = f" In trials that ended early before, by a touch or stuck, it now shows: {shown}."
    touches = (cure.before[Symptom.COLLISION], cure.after[Symptom.COLLISION])
    touched = ""
    if any(touches):
        again = ""
        if cure.again is not None:
            again = (
                f"; in {cure.again.trials} further trials of the probes with the further touch "
                f"{cure.again.before} before, {cure.again.after} after"
            )
        touched = (
            f" Touches in all {cure.trials} trials: {touches[0]} before, {touches[1]} after{again}."
        )
    return (
        f"The change: {change_told(cure.trial)}. On fresh seeds, which the search did not use, "
        f"{cure.before_target} of {cure.target_trials} trials showed it before and "
        f"{cure.after_target} after. In the {cure.compared} trials of "
        f"{'the' if cure.undriven else 'all'} probes that did not end early before, "
        f"{price_told(cure)}."
        f"{touched}{instead}{_judgement_cut_short(cure)}"
    )


def _judgement_cut_short(cure: Judged) -> str:
    if not cure.lacking:
        return ""
    names = f"; not driven with the change: {', '.join(cure.undriven)}" * bool(cure.undriven)
    return (
        f" There was no time for {cure.lacking} further trials of this judgement{names}. The same "
        "command goes on with them."
    )


def _rare_told(symptom: Symptom, rarity: Rarity) -> str:
    """Returns why no change is tried for a symptom."""
    needed = f"; here they need about {rarity.needed} pairs" if rarity.needed else ""
    return (
        f"{symptom} is too rare to find its cause: {rarity.shown} of {rarity.trials} further "
        f"trials of the unchanged file have any of it. A change is shown to help by {LEAST_FALLS} "
        f"pairs of trials in which it falls, and at most {MOST_PAIRS} pairs are driven{needed}."
    )


def _preferred(judged: Sequence[Judged], cure: Judged) -> str:
    """Returns why a change is offered before one that was judged before it; '' if none was."""
    first = judged[0]
    if first is cure:
        return ""
    if first.fails:
        why = "the program fails in a trial"
    elif not first.is_gone:
        why = (
            f"{first.after_target} of {first.target_trials} fresh trials still show it, "
            f"{first.before_target} before"
        )
    elif len(first.worse) > len(cure.worse):
        why = f"more trials show {', '.join(first.worse)}"
    else:
        why = f"the trials show {first.left} symptoms in all, with the change offered {cure.left}"
    return (
        f" It is offered in place of {change_told(first.trial)}, which was judged first: "
        f"with that {why}."
    )


def _likeliest(visit: Visit) -> str:
    """Returns a sentence on the likeliest cause; '' if it is the only one and its change offered.

    Where driving cannot tell it from others, these are named and what speaks for it.
    """
    first, rivals, cure = visit.shown[0], visit.rivals, visit.cure
    if first.trial is None or not (rivals or (cure is not None and cure.tried is not first)):
        return ""
    places = " and ".join(map(name_of_place, first.trial.changes))
    why = first.suspicion.reasons[0].rstrip(".")
    told = f" The likeliest cause is {places}, by reading: {why}."
    if not rivals:
        return told
    others = " or ".join(cause_told(entry) for entry in rivals)
    return (
        f"{told} By driving it cannot be told from others: with {cause_told(first)} the symptom "
        f"goes, and with {others} as well."
    )


def _not_drivable(visit: Visit) -> str:
    """Returns a sentence on a change that could not be driven, if by reading it is likelier."""
    shown = [entry.suspicion.score for entry in visit.shown[:1]]
    able = {entry.suspicion.cause.key for entry in visit.tried if entry.pairs}
    refused = [e for e in visit.tried if e.is_refused and e.suspicion.cause.key not in able]
    first = max(refused, key=lambda e: e.suspicion.score, default=None)
    if first is None or [first.suspicion.score] <= shown:
        return ""
    return f" Could not be driven, though likely by reading: {cause_told(first)} ({first.reason})."


def price_told(cure: Judged) -> str:
    """Returns the symptoms that more trials show with a change than without it."""
    if not cure.worse:
        return "no other symptom became worse"
    prices = "; ".join(
        f"the robot {LOOKS_LIKE[Symptom(name)]} ({name}) in "
        f"{counted(cure.after[name], 'trial')}, before the change in {cure.before[name]}"
        for name in cure.worse
    )
    return f"this has a price: {prices}"


def _why_not(visit: Visit) -> str:
    if not visit.judged:
        return " within the time; the same command goes on" if is_unfinished(visit) else ""
    first = visit.judged[0]
    if first.lacking:
        return " within the time; the same command goes on"
    if first.is_rare:
        shown = f"{first.before_target} of {first.target_trials}"
        return (
            f" (on fresh seeds {shown} trials of the unchanged file show it: too few to judge one)"
        )
    worse = first.worse
    if first.fails:
        return " (with the best one the program fails in a trial)"
    return (
        f" (on fresh seeds the best one adds {', '.join(worse)})"
        if worse
        else " (on fresh seeds the symptom stays in too many trials)"
    )


def evidence(entry: Tried) -> str:
    """Returns the evidence for a cause: severity before and after, pairs, p-value."""
    if not entry.pairs:
        return entry.reason or str(entry.verdict)
    left = f"; {entry.reason}" if entry.reason else ""
    touches = f"; {entry.touches} more touches" if entry.touches else ""
    pairs = f"{entry.pairs} pair{'s' * (entry.pairs != 1)}"
    return (
        f"severity {entry.before:.2f} -> {entry.after:.2f} in {pairs}, corrected "
        f"p = {entry.p_value:.2g}{touches}{left}"
    )


def assumed(visit: Visit, robot: str) -> list[str]:
    """Returns the assumptions of a visit, a sentence each."""
    cause: list[Cause] = [e.suspicion.cause for e in visit.tried if e.suspicion.cause.is_outside]
    cycles = ["Control cycles take no time in the probes: only the rules can find a slow computer."]
    if "compute_time" in visit.around.overrides.get("timing", {}):
        cycles = []
    lines = [
        f"Mass, lag, accelerations, lidar and localization are those of the robot {robot}, because "
        "no Nav2 file contains them.",
        *visit.around.remarks,
        *cycles,
        *told_blindness(visit.facts),
        *told_failures(visit.rows),
        "A symptom counts as worse if two more trials show it than before, since one may be "
        "chance; a touch counts from one more trial on.",
    ]
    if cause:
        lines.append(
            "Not tried, because no change of the file mends it: "
            + "; ".join(c.told for c in cause[:MOST_NAMED])
        )
    return lines
