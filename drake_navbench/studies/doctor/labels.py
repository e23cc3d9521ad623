"""Labels of changes: how far each is shown to help, for terminal, page and patch."""

from __future__ import annotations

from drake_navbench.studies.doctor.change_words import change_told
from drake_navbench.studies.doctor.judged import Judged
from drake_navbench.studies.doctor.offer import Kind, Offer
from drake_navbench.studies.doctor.told import wrapped
from drake_navbench.studies.doctor.tried import Tried, Verdict
from drake_navbench.studies.doctor.visited import Visit
from drake_navbench.studies.doctor.words import price_told

HEADING = "To try on the robot, one at a time, the likeliest first"


def cure_label(cure: Judged) -> str:
    """Returns the label of a change that is shown to help."""
    return f"Shown by driving: {_counts(cure)}; {price_told(cure)}."


def offer_label(offer: Offer) -> str:
    """Returns the label of a change to try, in a few sentences."""
    if offer.kind is Kind.TRADE and offer.judged is not None:
        price = price_told(offer.judged).removeprefix("this has a price: ")
        return f"Shown by driving, at a price: {_counts(offer.judged)}; but {price}."
    what = _helped(offer.tried) if offer.kind is Kind.HELPED else "Not shown by driving."
    why = next(iter(offer.tried.suspicion.reasons), "").rstrip(".")
    return " ".join([what, *[f"By reading: {why}."] * bool(why), _compared(offer)])


def patch_name(number: int) -> str:
    """Returns the name of an offer's patch; number: from 1 on."""
    return f"try_{number}.patch"


def told_of_offers(visit: Visit) -> list[str]:
    """Returns the lines on the changes to try; none where there are none."""
    if not visit.offers:
        return []
    lines = ["", f"{HEADING}:"]
    for number, offer in enumerate(visit.offers, 1):
        lines += wrapped(f"{patch_name(number)}: {change_told(offer.trial)}", "  ", "    ")
        lines += wrapped(offer_label(offer), "    ", "    ")
    return lines


def _counts(judged: Judged) -> str:
    return (
        f"of {judged.target_trials} fresh trials {judged.before_target} showed {judged.symptom} "
        f"before the change, {judged.after_target} with it"
    )


def _helped(entry: Tried) -> str:
    """Returns the sentence on a change that helped in the search."""
    fell = f"its severity falls from {entry.before:.2f} to {entry.after:.2f} in {entry.pairs} pairs"
    if entry.verdict is Verdict.SHOWN:
        return f"Shown in the search ({fell}), not yet judged on fresh seeds."
    return f"It helped in the search ({fell}), which is too little to show it."


def _compared(offer: Offer) -> str:
    """Returns the sentence on the trials that tell whether an offer makes something worse."""
    if offer.is_idle:
        return "No trial of this program depends on it, so none was driven."
    judged = offer.judged
    if judged is None:
        return "There was no time to see if it makes something worse."
    count = f"{judged.trials} trial{'s' * (judged.trials != 1)}"
    if judged.same == judged.trials:
        return f"Nothing changes in {count}, to the last digit: they do not show what it does."
    same = f"; {judged.same} of them stay the same to the last digit" if judged.same else ""
    before, after = f"{judged.before_mean:.2f}", f"{judged.after_mean:.2f}"
    goes = f"goes from {before} to {after}" if before != after else f"stays at {before}"
    severity = f" The mean severity of {offer.symptom}, a symptom above 1, {goes}."
    return (
        f"Harmless in {count} of the probes: no touch more, no symptom in two more{same}."
        f"{severity if {before, after} != {'0.00'} else ''}"
    )
