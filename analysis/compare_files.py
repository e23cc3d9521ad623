"""Writes a comparison of results folders as Markdown and as JUnit XML."""

from __future__ import annotations

from drake_navbench.analysis.compare import FolderComparison
from drake_navbench.analysis.junit import FAILURE, SKIPPED, Case, case_of, junit_text
from drake_navbench.analysis.paired_tests import Family, PairedVerdict
from drake_navbench.analysis.paired_text import PROMISE, cells_text, equal_text, lost_lines, table

TITLE = "# Compared with"


def to_markdown(comparison: FolderComparison) -> str:
    """Returns the comparison in Markdown: errors, regressions, undecided losses, all changes."""
    judged, regressions = comparison.judged, comparison.regressions
    lines = [f"{TITLE} {comparison.baseline}", ""]
    lines.append(f"Listed metrics: {', '.join(comparison.listed) or 'none'}.")
    lines += [f"{len(regressions)} of them became worse.", "", f"In all: {comparison.summary}."]
    lines += ["", equal_text(judged), "", PROMISE, ""]
    if judged.one_trial_cells:
        lines += [
            "All seeds drive one and the same trial, which counts once: "
            f"{cells_text(judged.one_trial_cells)}.",
            "",
        ]
    for title, told in (
        ("Ended as an error", lost_lines(comparison.errors)),
        ("Losses that so few trials do not decide", comparison.undecided_losses),
    ):
        if told:
            lines += [f"## {title}", "", *(f"- {line}" for line in told), ""]
    undecided = [
        f for f in judged.of(PairedVerdict.UNDECIDED) if f.quantity.family is Family.LISTED
    ]
    for title, chosen in (
        ("Regressions", regressions),
        ("Worse", judged.of(PairedVerdict.WORSE)),
        ("Better", judged.of(PairedVerdict.BETTER)),
        ("Changed, neither better nor worse", judged.of(PairedVerdict.CHANGED)),
        ("Listed metrics that so few trials do not decide", undecided),
    ):
        if chosen:
            lines += [f"## {title}", "", *table(chosen), ""]
    for title, notes in (
        ("Not compared", comparison.not_compared),
        ("Driven with other inputs", comparison.changed_inputs),
    ):
        if notes:
            lines += [f"## {title}", "", *(f"- {line}" for line in notes), ""]
    return "\n".join(lines)


def to_junit(comparison: FolderComparison) -> str:
    """Returns JUnit XML: one test case for each listed metric, scenario and controller.

    A trial that ended as an error is a failed test case; a trial that could not be compared is a
    skipped one.
    """
    undecided = comparison.judged.undecided_losses
    cases = [case_of(f, undecided, f.label) for f in comparison.listed_findings]
    for trial in comparison.errors:
        place = ".".join(trial[:3])
        text = f"ended as an error: {trial.reason}"
        cases.append(Case(place, f"seed {trial.seed}", FAILURE, text))
    for entry in comparison.unmatched:
        cases.append(Case(".".join(entry[:3]), "trials", SKIPPED, entry.reason))
    for file in comparison.left_out:
        cases.append(Case("files", file.path, SKIPPED, file.reason))
    return junit_text("drake_navbench.commands.compare", cases)
