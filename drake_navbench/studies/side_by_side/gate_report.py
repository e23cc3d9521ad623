"""The result of a gate: Markdown for a pull request, JUnit for CI, the worst seed to look at."""

from __future__ import annotations

import math
from pathlib import Path

from drake_navbench.analysis.junit import ERROR, FAILURE, Case, case_of, junit_text
from drake_navbench.analysis.metrics.definition import Better
from drake_navbench.analysis.numbers import counted
from drake_navbench.analysis.paired_comparison import detectable_difference
from drake_navbench.analysis.paired_tests import (
    SUCCESS,
    TOUCH,
    Family,
    Finding,
    Judged,
    PairedVerdict,
)
from drake_navbench.analysis.paired_text import (
    PROMISE,
    cells_text,
    equal_text,
    lost_lines,
    table,
    undecided_sentence,
)
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.logs.text_tables import markdown_table
from drake_navbench.studies.side_by_side.gate import GateResult, Side, column_of

TITLE = "# Nav2 gate:"


def to_markdown(result: GateResult) -> str:
    """Returns a result's page: the verdict, the changes, and the smallest change that shows."""
    lines = [
        f"{TITLE} {result.light}",
        "",
        f"Base: {_side(result.base)}. Head: {_side(result.head)}.",
        "",
        *_compiled(result.base, result.head),
    ]
    judged = result.judged
    if judged is None:
        return "\n".join([*lines, "Both are the same program; nothing was driven.", ""])
    tests = ", ".join(f"{judged.tests(family)} of {family}" for family in Family)
    lines += [
        f"{counted(len(result.scenarios), 'scenario')}, {counted(result.trials, 'trial')} each. "
        f"{equal_text(judged)}",
        "",
        f"Tests: {tests}. {PROMISE}",
        "",
    ]
    if judged.one_trial_cells:
        lines += [
            "All seeds drive one and the same trial, which counts once: "
            f"{cells_text(judged.one_trial_cells)}.",
            "",
        ]
    known = [trial for trial in judged.lost if trial.base_fails]
    for title, told in (
        ("Came to no end", lost_lines(judged.new_failures)),
        ("Ended in errors, as trials of the base do", lost_lines(known)),
        (
            "Measured in the base alone",
            (f"{f.scenario}, {f.controller}: {f.quantity.name}" for f in result.gone),
        ),
        (
            "Losses that so few trials do not decide",
            map(undecided_sentence, judged.undecided_losses),
        ),
    ):
        if entries := [f"- {line}" for line in told]:
            lines += [f"## {title}", "", *entries, ""]
    for title, verdict in (
        ("Became worse", PairedVerdict.WORSE),
        ("Became better", PairedVerdict.BETTER),
        ("Changed, by too little to matter", PairedVerdict.SMALL),
    ):
        if found := judged.of(verdict):
            lines += [f"## {title}", "", *table(found), ""]
    lines += [
        "## The smallest changes that would be seen",
        "",
        *_outcomes_seen(judged, result.trials),
        "",
    ]
    lines += ["The mean change that would turn the gate red with a probability of 80%.", ""]
    return "\n".join([*lines, *_detectable(judged), ""])


def to_junit(result: GateResult) -> str:
    """Returns JUnit XML: a test case a scenario, controller and metric that is listed or worse.

    A trial of the head that came to no end is a failure if the base lost none of its controller and
    scenario, else an error.
    """
    judged = result.judged
    if judged is None:
        return junit_text("drake_navbench.nav2-gate", [])
    undecided = judged.undecided_losses
    cases = [
        case_of(finding, undecided)
        for finding in judged.findings
        if finding.quantity.family is not Family.OTHERS or finding.verdict is PairedVerdict.WORSE
    ]
    for trial in judged.lost:
        ending = "missing" if trial.is_missing else f"ended as an error: {trial.reason}"
        outcome = ERROR if trial.base_fails else FAILURE
        place = f"{trial.scenario}.{trial.controller}"
        cases.append(Case(place, f"seed {trial.seed}", outcome, ending))
    return junit_text("drake_navbench.nav2-gate", cases)


def worst_logs(result: GateResult) -> tuple[Path, Path] | None:
    """Returns both logs of the seed that lost most in the first regression; None without one."""
    if not result.regressions or result.folder is None:
        return None
    worst = result.regressions[0]
    table = result.table[result.table["scenario"] == worst.scenario]
    name, outcome = worst.quantity.name, table["outcome"]
    own = {TOUCH: outcome == Outcome.COLLIDED, SUCCESS: outcome == Outcome.SUCCEEDED}
    table = table.assign(worst=own.get(name, table.get(name)).astype(float))
    columns = [column_of(worst.controller, side) for side in (result.base, result.head)]
    by_trial = table.pivot_table(index="trial", columns="controller", values="worst")
    loss = by_trial[columns[1]] - by_trial[columns[0]]
    trial = (loss if worst.quantity.better is Better.LOWER else -loss).idxmax()
    folder = ResultsFolder(result.folder)
    base, head = (folder.log_path(worst.scenario, column, int(trial)) for column in columns)
    return base, head


def _side(side: Side) -> str:
    return f"`{side.name}`, {side.about}" if side.about else f"`{side.name}`"


def _compiled(base: Side, head: Side) -> list[str]:
    """Returns a line for each build whose flags are more than the portable ones."""
    first, second = (side.flags or "no more than the portable ones" for side in (base, head))
    if first != second:
        return [f"**The two were compiled with different flags**: {first}; {second}.", ""]
    return [f"Flags of packages: {first}.", ""] if base.flags else []


def _outcomes_seen(judged: Judged, trials: int) -> list[str]:
    """Returns sentences on the number of lost trials at which the gate turns red.

    They warn where that number is larger than the number of trials.
    """
    own = [f for f in judged.findings if f.quantity.family is Family.OUTCOMES]
    tested = [f for f in own if not f.is_one_trial]
    if not tested:
        return ["Nothing is random in these trials: every change of an outcome turns the gate red."]
    fewest = tested[0].fewest_differing
    text = (
        f"A trial that ends in an error turns the gate red. So do {fewest} trials of a "
        f"scenario and "
        f"controller that touch, or do not arrive, in the head alone."
    )
    if fewest > trials:
        text += f" **{trials} trials are too few** for that."
    return [text]


def _detectable(judged: Judged) -> list[str]:
    own = [f for f in judged.findings if f.quantity.family is Family.LISTED]
    units = {f.quantity.name: f.quantity.unit for f in own}
    rows: dict[tuple[str, str], dict[str, str]] = {}
    for f in own:
        rows.setdefault((f.scenario, f.controller), {})[f.quantity.name] = _seen(f)
    titles = [f"{name} [{unit}]" if unit else name for name, unit in units.items()]
    return markdown_table(
        ["scenario", "controller", *titles],
        ([*cell, *(values[name] for name in units)] for cell, values in rows.items()),
        "ll" + "r" * len(titles),
    )


def _seen(finding: Finding) -> str:
    found = finding.comparison
    value = detectable_difference(found.sd, found.pairs, finding.level)
    if finding.is_one_trial or value == 0.0:
        return "any"
    return f"{value:.2g}" if math.isfinite(value) else "–"
