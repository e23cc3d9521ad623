"""The doctor's first look as printed lines of 80 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

from drake_navbench.errors import printable
from drake_navbench.inputs.check import CheckRow
from drake_navbench.nav2.sensing import LIDAR_HEIGHT
from drake_navbench.studies.doctor.alike import Alike
from drake_navbench.studies.doctor.cures import told_with_step
from drake_navbench.studies.doctor.driving import Row, has_failed, probe_of
from drake_navbench.studies.doctor.facts import NO_PLUGIN, Facts
from drake_navbench.studies.doctor.reading import Suspicion
from drake_navbench.studies.doctor.rules.rule import Finding
from drake_navbench.studies.doctor.symptoms import LOOKS_LIKE, Symptom

# Nodes that a file may leave to the robot's own settings.
TAKEN_OVER = ("local_costmap", "global_costmap")
WIDTH = 80
INDENT = "    "
# Symptoms of a finding that are named, the likeliest first.
MOST_SYMPTOMS = 2
QUESTION = (
    "Which of these is most like yours? --like NAME puts its cures first; of two names the more "
    "alike stands first:"
)
# Suspects that are named where a symptom is told.
MOST_SUSPECTS = 5


def told_no_findings(facts: Facts) -> str:
    """Returns the line on a file in which no rule finds anything, but for what was left out."""
    if facts.left_out:
        return (
            "No findings but what was left out: none of the doctor's rules sees a fault in the "
            "rest of this file."
        )
    return "No findings: none of the doctor's rules sees a fault in this file."


def wrapped(text: str, first: str = "", rest: str = INDENT) -> list[str]:
    """Returns a text in lines of 80 columns."""
    return textwrap.wrap(
        printable(text),
        WIDTH,
        initial_indent=first,
        subsequent_indent=rest,
        break_on_hyphens=False,
        break_long_words=True,
    )


def told_of_lent_robot(robot: str) -> str:
    """Returns the line about the robot that is taken where the user names none."""
    return (
        f"Robot: {robot}, as no --robot is given. A Nav2 file does not have the mass, lidar and "
        "drive of yours."
    )


def told_of_reading(
    facts: Facts,
    findings: Sequence[Finding],
    suspects: Sequence[Suspicion],
    symptom: Symptom | None,
) -> list[str]:
    """Returns the lines of the first look: the findings, and what may cause the symptom."""
    kinds = " before ".join(facts.kinds) or "unknown"
    told_by = f" ({facts.mark}; --nav2-release sets another)" if facts.mark else ""
    borrowed = [name for name in TAKEN_OVER if facts.nodes and not facts.has_node(name)]
    lacks = (
        f" The file has no {' and no '.join(borrowed)}: the values of --robot are used."
        if borrowed
        else ""
    )
    others = ", ".join(facts.others)
    more = (
        f" Other controllers, not read: {others} (--controller NAME reads one)." if others else ""
    )
    controller = f"{facts.plugin or 'controller'} ({kinds})"
    if facts.plugin == NO_PLUGIN:
        why = "which are unknown here or left out" if facts.left_out else "of which it gives none"
        controller = f"all but the file's controllers, {why}"
    what = f"{controller}, Nav2 {facts.release}{told_by}"
    lines = wrapped(f"Read: {what}.{lacks}{more}", rest="  ")
    lines += [part for line in facts.left_out for part in wrapped(f"Left out: {line}", rest="  ")]
    if symptom is None:
        findings = without_repeated_cures(findings)
    lines.append("")
    lines += [f"Findings ({len(findings)})"] if findings else wrapped(told_no_findings(facts))
    for finding in findings:
        lines += _finding_lines(finding, facts)
    if symptom is not None:
        lines += [
            "",
            *wrapped(f"What may cause {symptom} (the robot {LOOKS_LIKE[symptom]}):", rest="  "),
        ]
        for number, suspicion in enumerate(suspects[:MOST_SUSPECTS], 1):
            lines += _suspicion_lines(number, suspicion, facts)
        if not suspects:
            lines.append("  the doctor knows no cause for this controller")
    return lines


def told_question(alike: Sequence[Alike]) -> list[str]:
    """Returns the lines that ask which of some known complaints is most like the user's."""
    if not alike:
        return []
    lines = ["", *wrapped(QUESTION, rest="  ")]
    for entry in alike:
        lines += wrapped(f"{entry.name}  {entry.line}", "  ", " " * 9)
    return lines


def told_of_model(rows: Sequence[CheckRow]) -> list[str]:
    """Returns the lines on what the Nav2 file and the robot's model contradict each other in."""
    if not rows:
        return []
    heading = f"{rows[0].node} contradict each other ({len(rows)})"
    lines = (f"{row.parameter}: {row.remark}" for row in rows)
    return ["", *wrapped(heading), *(part for line in lines for part in wrapped(line, "- "))]


def without_repeated_cures(findings: Sequence[Finding]) -> list[Finding]:
    """Returns findings without those whose cures another one names as well.

    The one with more cures stays; of two with the same cures the first, because the rules about one
    thing, as a source of a costmap, come before those about many.
    """
    kept: list[Finding] = []
    for number, finding in enumerate(findings):
        own = _named_cures(finding)
        others = [*findings[:number], *findings[number + 1 :]]
        is_repeated = own and any(
            own < _named_cures(other) or (own == _named_cures(other) and other in kept)
            for other in others
        )
        if not is_repeated:
            kept.append(finding)
    return kept


def _named_cures(finding: Finding) -> frozenset[tuple[str, str, str]]:
    """Returns place, direction and value of each cure; none where the first has no value."""
    if finding.cures[0].to is None:
        return frozenset()
    return frozenset((cause.place, cause.direction, str(cause.to)) for cause in finding.cures)


def told_cures(finding: Finding, facts: Facts) -> str:
    """Returns the cures of a finding as instructions, the best first."""
    cures = "; or ".join(told_with_step(cause, facts) for cause in finding.cures)
    return finding.rule.advice or cures


def _finding_lines(finding: Finding, facts: Facts) -> Iterator[str]:
    yield from wrapped(f"{finding.rule.name}: {finding.seen}", "- ")
    likely = finding.likely[:MOST_SYMPTOMS]
    if likely:
        looks = ", or ".join(LOOKS_LIKE[s] for s in likely)
        yield from wrapped(f"possible symptom: the robot {looks}", INDENT)
    yield from wrapped(f"cure: {told_cures(finding, facts)}", INDENT)
    yield from wrapped(f"source: {finding.rule.source}", INDENT)


def _suspicion_lines(number: int, suspicion: Suspicion, facts: Facts) -> Iterator[str]:
    yield from wrapped(f"{number}. {told_with_step(suspicion.cause, facts)}", "  ", "     ")
    for reason in suspicion.reasons[:2]:
        yield from wrapped(reason, "     ", "     ")


def told_failures(rows: Sequence[Row]) -> list[str]:
    """Returns a sentence on trials in which the program failed, and which show nothing."""
    failed = [row for row in rows if has_failed(row)]
    if not failed:
        return []
    names = ", ".join(dict.fromkeys(map(probe_of, failed)))
    return [
        f"{len(failed)} of {len(rows)} trials of the unchanged file failed and show nothing "
        f"({names}): {failed[0]['reason']}"
    ]


def told_blindness(facts: Facts) -> list[str]:
    """Returns a sentence for each layer of a costmap that does not see the probes' lidar.

    The lidar is the robot file's; the user's own may be lower.
    """
    return [
        f"{place}: {remark}; correct the heights or, if your lidar is "
        "at another height, give --robot a file with it"
        for place, remark in facts.doubts.items()
        if remark.startswith(LIDAR_HEIGHT)
    ]
