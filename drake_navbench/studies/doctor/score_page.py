"""The page of the known cases: the score, the baselines, and the answer to every case."""

from __future__ import annotations

from collections.abc import Sequence

from drake_navbench.studies.doctor.known_cases import (
    Case,
    Score,
    Scored,
    clusters,
    most_frequent_owner,
    score_of,
    scores_without_skill,
)

TITLE = "# The doctor on known cases"
HEAD = "| cases | number | first | among three | first | among three |\n|---|---|---|---|---|---|"


def scores(scored: Sequence[Scored], cases: Sequence[Case]) -> list[Score]:
    """Returns the rows of the table: the doctor's, then those of methods without skill."""
    known = [entry for entry in scored if entry.case.is_reproducible]
    rows = [score_of("all", scored), score_of("with a whole or partial file", known)]
    rows.append(score_of("with a whole file", [entry for entry in scored if entry.has_file]))
    owner = most_frequent_owner(cases)
    if owner:
        rows.append(score_of(f"all, without {owner}", clusters(scored, owner)))
        rows.append(score_of(f"with a file, without {owner}", clusters(known, owner)))
    return rows + scores_without_skill([entry.case for entry in known])


def score_page(scored: Sequence[Scored], cases: Sequence[Case]) -> str:
    """Returns the page as Markdown."""
    lines = [TITLE, "", HEAD]
    lines += [row.text for row in scores(scored, cases)]
    lines += ["", "## Case by case", ""]
    for entry in scored:
        lines += _case_lines(entry)
    return "\n".join(lines) + "\n"


def _case_lines(entry: Scored) -> list[str]:
    case = entry.case
    place = "missed" if entry.rank is None else f"hit at {entry.rank}"
    what = "whole file" if entry.has_file else "named values"
    lines = [f"- **{case.id}** {case.symptom_class}, {case.controller}, {what}: {place}"]
    if entry.skipped:
        lines.append(f"  - not read: {entry.skipped}")
    answers = "; ".join(suspicion.cause.told for suspicion in entry.causes)
    lines.append(f"  - the doctor: {answers}")
    if entry.rank != 1:
        cures = "; ".join(f"{name} {cure}" for name, cure in case.culprits.items())
        lines.append(f"  - the cure: {cures}")
    if entry.why:
        lines.append(f"  - why not first: {entry.why}")
    return lines
