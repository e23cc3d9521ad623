"""JUnit XML of paired tests, for the pages on which CI shows failed tests."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple
from xml.etree import ElementTree

from drake_navbench.analysis.paired_tests import Finding, PairedVerdict
from drake_navbench.analysis.paired_text import sentence, undecided_sentence

FAILURE, ERROR, SKIPPED, OUTPUT = "failure", "error", "skipped", "system-out"


class Case(NamedTuple):
    """A test case; outcome: FAILURE, ERROR or SKIPPED with a message, OUTPUT with a text, or ''."""

    place: str
    name: str
    outcome: str = ""
    text: str = ""


def case_of(finding: Finding, undecided: Collection[Finding], *labels: str) -> Case:
    """Returns the test case of a finding; labels: stand before scenario and controller."""
    place = ".".join([*labels, finding.scenario, finding.controller])
    name = finding.quantity.name
    if finding.verdict is PairedVerdict.WORSE:
        return Case(place, name, FAILURE, sentence(finding))
    if finding.verdict in (PairedVerdict.NO_VALUE, PairedVerdict.GONE):
        return Case(place, name, SKIPPED, "no pair of trials with a value")
    if finding in undecided:
        return Case(place, name, OUTPUT, undecided_sentence(finding))
    return Case(place, name)


def junit_text(suite_name: str, cases: Sequence[Case]) -> str:
    """Returns the XML of one suite of tests."""
    outcomes = [case.outcome for case in cases]
    suite = ElementTree.Element(
        "testsuite",
        name=suite_name,
        tests=str(len(cases)),
        failures=str(outcomes.count(FAILURE)),
        errors=str(outcomes.count(ERROR)),
        skipped=str(outcomes.count(SKIPPED)),
    )
    for place, name, outcome, text in cases:
        case = ElementTree.SubElement(suite, "testcase", classname=place, name=name)
        if outcome == OUTPUT:
            ElementTree.SubElement(case, outcome).text = text
        elif outcome:
            ElementTree.SubElement(case, outcome, message=text)
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"
