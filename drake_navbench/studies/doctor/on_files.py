"""The lines about a run's Nav2 files that tell what the doctor's rules find in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from drake_navbench.nav2.whole_files import FileColumns
from drake_navbench.studies.doctor.cures import told_with_step
from drake_navbench.studies.doctor.facts import Facts, facts_of
from drake_navbench.studies.doctor.far_values import FAR
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.reading import findings_of
from drake_navbench.studies.doctor.rules.rule import Finding
from drake_navbench.studies.doctor.told import without_repeated_cures


def lines_on_file(patient: Patient, command: str) -> list[str]:
    """Returns a line with the number of findings on a file that the doctor's command shows."""
    count = len(without_repeated_cures(findings_of(patient.facts())))
    faults = f"{count} possible fault{'s' if count > 1 else ''}"
    return [f"The doctor's rules find {faults} in the file: {command}"] if count else []


def lines_on_change(files: Sequence[FileColumns]) -> list[str]:
    """Returns a line for each finding that only one of two files has: the first or another one.

    Findings about values that are merely far from the usual ones are left out.
    """
    before, *changed = [(file.name, _findings(file)) for file in files]
    return [line for after in changed for line in _lines(before, after)]


def _lines(before: tuple[str, dict[str, str]], after: tuple[str, dict[str, str]]) -> Iterator[str]:
    (old, had), (new, has) = before, after
    for name, told in has.items():
        if name not in had:
            yield f"The doctor finds in {new}, not in {old}: {told} ({name})"
    for name, told in had.items():
        if name not in has:
            yield f"The doctor finds in {old}, not in {new}: {told} ({name})"


def _findings(file: FileColumns) -> dict[str, str]:
    """Returns the sentence on each finding about any controller, by the rule's name."""
    told: dict[str, str] = {}
    for preset in file.presets or (None,):
        facts = facts_of(file.setup, preset)
        for finding in without_repeated_cures(findings_of(facts)):
            if not finding.rule.name.startswith(FAR):
                told.setdefault(finding.rule.name, _told(finding, facts))
    return told


def _told(finding: Finding, facts: Facts) -> str:
    cures = "; or ".join(told_with_step(cause, facts) for cause in finding.cures)
    return f"{finding.seen}; cure: {finding.rule.advice or cures}"
