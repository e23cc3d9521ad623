"""The result of a gate: Markdown for a pull request, JUnit for CI, the worst seed to look at."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from xml.etree import ElementTree

from drake_navbench.analysis.metrics.definition import Better
from drake_navbench.analysis.statistics import smallest_p_value
from drake_navbench.native.builds import Build
from drake_navbench.results import ResultsFolder
from drake_navbench.side_by_side.gate import (
    ALARM_RATE,
    Finding,
    GateResult,
    Verdict,
    column_of,
    listed,
)


def to_markdown(result: GateResult) -> str:
    """Returns the result: the verdict, what changed, and what so few trials could have shown."""
    worse = result.regressions
    equal, pairs = result.equal
    lines = [
        f"# Nav2 gate: {'red' if worse else 'green'}",
        "",
        f"Base: {_build(result.base)}. Head: {_build(result.head)}.",
        "",
        *_compiled(result.base, result.head),
    ]
    if result.folder is None:
        return "\n".join([*lines, "Both are the same program; nothing was driven.", ""])
    tests = sum(math.isfinite(finding.p_value) for finding in result.findings)
    lines += [
        f"{len(result.scenarios)} scenarios, {result.trials} trials each: {pairs} pairs of equal "
        f"seed, of which {equal} drove the same. {tests} tests, corrected by Holm: the whole gate "
        f"raises a false alarm in at most {ALARM_RATE:.0%} of changes that change nothing.",
        "",
    ]
    least = smallest_p_value(result.trials, tests)
    if least > ALARM_RATE:
        lines += [
            f"**{result.trials} trials are too few for any alarm**: if each of them changed alike, "
            f"p would be {least:.2g} after the correction.",
            "",
        ]
    if result.repeated:
        cells = ", ".join(f"{controller} in {scenario}" for scenario, controller in result.repeated)
        lines += [
            f"All seeds drive one and the same trial, so that nothing is told of chance: {cells}.",
            "",
        ]
    for title, verdict in (
        ("Became worse", Verdict.WORSE),
        ("Became better", Verdict.BETTER),
        ("Changed, by too little to matter", Verdict.SMALL),
    ):
        found = [f for f in result.findings if f.verdict is verdict]
        if found:
            found.sort(key=lambda finding: finding.p_value)
            lines += [f"## {title}", "", *_changes(found), ""]
    lines += ["## What would have been seen", ""]
    lines += ["The mean change that would turn the gate with a probability of 80%.", ""]
    lines += [*_detectable(listed(result.findings)), ""]
    return "\n".join(lines)


def to_junit(result: GateResult) -> str:
    """Returns JUnit XML: a test case a scenario, controller and metric that is listed or worse."""
    worse = result.regressions
    cases = list(listed(result.findings))
    cases += [finding for finding in worse if finding not in cases]
    skipped = [f for f in cases if f.verdict is Verdict.NO_VALUE]
    suite = ElementTree.Element(
        "testsuite",
        name="drake_navbench.nav2-gate",
        tests=str(len(cases)),
        failures=str(len(worse)),
        errors="0",
        skipped=str(len(skipped)),
    )
    for finding in cases:
        case = ElementTree.SubElement(
            suite,
            "testcase",
            classname=f"{finding.scenario}.{finding.controller}",
            name=finding.metric.name,
        )
        if finding.verdict is Verdict.WORSE:
            ElementTree.SubElement(case, "failure", message=sentence(finding))
        elif finding.verdict is Verdict.NO_VALUE:
            ElementTree.SubElement(case, "skipped", message="no pair of trials with a value")
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"


def sentence(finding: Finding) -> str:
    """Returns a finding as one line."""
    unit = f" {finding.metric.unit}" if finding.metric.unit else ""
    return (
        f"{finding.scenario}, {finding.controller}: {finding.metric.name} {finding.verdict}: "
        f"{finding.base_mean:.4g} -> {finding.head_mean:.4g}{unit} "
        f"({finding.comparison.difference:+.3g} in {finding.comparison.pairs} pairs, "
        f"p {finding.p_value:.2g})"
    )


def worst_logs(result: GateResult) -> tuple[Path, Path] | None:
    """Returns the logs of base and head for the seed that lost most in the surest regression."""
    if not result.regressions or result.folder is None:
        return None
    worst = result.regressions[0]
    table = result.table[result.table["scenario"] == worst.scenario]
    columns = [column_of(worst.controller, build) for build in (result.base, result.head)]
    by_trial = table.pivot_table(index="trial", columns="controller", values=worst.metric.name)
    loss = by_trial[columns[1]] - by_trial[columns[0]]
    trial = (loss if worst.metric.better is Better.LOWER else -loss).idxmax()
    folder = ResultsFolder(result.folder)
    base, head = (folder.log_path(worst.scenario, column, int(trial)) for column in columns)
    return base, head


def _build(build: Build) -> str:
    return f"`{build.name}`, Nav2 {build.where_from}"


def _compiled(base: Build, head: Build) -> list[str]:
    """Returns what the two were compiled with, where that is more than the portable flags."""
    first, second = (build.more_flags or "no more than the portable ones" for build in (base, head))
    if first != second:
        return [f"**The two were compiled with different flags**: {first}; {second}.", ""]
    return [f"Flags of packages: {first}.", ""] if base.more_flags else []


def _changes(findings: Iterable[Finding]) -> list[str]:
    lines = [
        "| scenario | controller | metric | base | head | change | pairs | p (Holm) |",
        "|---|---|---|---:|---:|---:|---:|---:|",
    ]
    for f in findings:
        unit = f" [{f.metric.unit}]" if f.metric.unit else ""
        found = f.comparison
        cells = [f.scenario, f.controller, f.metric.name + unit]
        cells += [f"{f.base_mean:.4g}", f"{f.head_mean:.4g}", f"{found.difference:+.3g}"]
        cells += [str(found.pairs), f"{f.p_value:.2g}"]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return lines


def _detectable(findings: Sequence[Finding]) -> list[str]:
    names = list(dict.fromkeys(f.metric.name for f in findings))
    units = {f.metric.name: f.metric.unit for f in findings}
    rows: dict[tuple[str, str], dict[str, float]] = {}
    for f in findings:
        rows.setdefault((f.scenario, f.controller), {})[f.metric.name] = f.detectable
    titles = [f"{name} [{units[name]}]" if units[name] else name for name in names]
    lines = [
        f"| scenario | controller | {' | '.join(titles)} |",
        "|---|---|" + "---:|" * len(names),
    ]
    for (scenario, controller), values in rows.items():
        shown = [_number(values.get(name, math.nan)) for name in names]
        lines.append(f"| {scenario} | {controller} | {' | '.join(shown)} |")
    return lines


def _number(value: float) -> str:
    return "any" if value == 0.0 else f"{value:.2g}" if math.isfinite(value) else "–"
