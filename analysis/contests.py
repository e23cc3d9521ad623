"""Pairs of columns whose trials are compared: of two tables, of one table, or by tasks of a suite.

The tasks of a suite, such as the goals that are drawn on a map, count as one scenario in which each
task is one pair: trials of one task are not independent of each other.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.paired_trials import Contest
from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.logs.log import Outcome

ARROW = " -> "
# The outcome of a task: the worst one among its trials.
WORST_FIRST = (Outcome.ERROR, Outcome.COLLIDED)


class Match(NamedTuple):
    """A column of the base, and the one that is judged against it."""

    old: str
    new: str

    @property
    def name(self) -> str:
        """The name under which both are compared, 'old -> new'."""
        return self.old if self.old == self.new else f"{self.old}{ARROW}{self.new}"


def matches_between(
    before: Sequence[str], after: Sequence[str], requested: Sequence[Match] = ()
) -> list[Match]:
    """Returns the pairs of columns, one of each folder, that are compared.

    First come the pairs in `requested`, then the columns with equal names. If one column is left in
    each folder after that, these two are a pair. Raises InputError where a column in `requested`
    does not exist or occurs twice.
    """
    _require_known([match.old for match in requested], before)
    _require_known([match.new for match in requested], after)
    taken_old, taken_new = ({match[side] for match in requested} for side in (0, 1))
    equal = [n for n in before if n in after and n not in taken_old and n not in taken_new]
    left_old = [name for name in before if name not in (*taken_old, *equal)]
    left_new = [name for name in after if name not in (*taken_new, *equal)]
    last = [Match(left_old[0], left_new[0])] if len(left_old) == len(left_new) == 1 else []
    return [*requested, *(Match(name, name) for name in equal), *last]


def matches_within(
    columns: Sequence[str], files: Mapping[str, Mapping[str, str]], requested: Sequence[Match] = ()
) -> list[Match]:
    """Returns the pairs of columns of one folder that are compared.

    The first of these rules that gives a pair counts:
    - `requested` has pairs: these.
    - The columns come from several whole Nav2 files: a column of the first file with the column of
      the same plugin in each other file. Two files with one column each need not share the plugin.
    - Else the first column with every other one.
    files: for each file's alias its columns by plugin. Raises InputError where a column in
    `requested` does not exist.
    """
    if requested:
        _require_known([name for match in requested for name in match], columns)
        return list(requested)
    # A manifest has them by the alphabet; the first file is that of the first column.
    order = {name: place for place, name in enumerate(columns)}
    plugins = sorted(
        files.values(), key=lambda own: min(order.get(name, len(order)) for name in own.values())
    )
    found = []
    for other in plugins[1:]:
        first = plugins[0]
        if len(first) == len(other) == 1:
            found.append(Match(*first.values(), *other.values()))
        else:
            found += [Match(first[name], other[name]) for name in first if name in other]
    return found or [Match(columns[0], other) for other in columns[1:]]


def _require_known(names: Sequence[str], columns: Sequence[str]) -> None:
    for name in names:
        if name not in columns:
            raise InputError(f"--match: no column {name!r}{nearest_name_hint(name, columns)}")


def read_matches(texts: Sequence[str], before: Sequence[str], after: Sequence[str]) -> list[Match]:
    """Returns the matches of `--match OLD=NEW`; raises InputError.

    before, after: the columns that there are. A name may have equals signs, as of a variant: the
    text is parted where both names are columns.
    """
    return [_read_match(text, before, after) for text in texts]


def _read_match(text: str, before: Sequence[str], after: Sequence[str]) -> Match:
    ways = [
        Match(text[:place], text[place + 1 :])
        for place, letter in enumerate(text)
        if letter == "=" and 0 < place < len(text) - 1
    ]
    if not ways:
        raise InputError(f"--match {text!r}: expected OLD=NEW")
    known = [way for way in ways if way.old in before and way.new in after]
    if len(known) > 1:
        told = " or ".join(f"{way.old!r} with {way.new!r}" for way in known)
        raise InputError(f"--match {text!r}: may be {told}; rename a column by --name")
    # Neither pair fits: take one with one known name, so that the error names the other.
    half = [way for way in ways if way.old in before or way.new in after]
    return (known or half or ways)[0]


def contest_of(
    before: pd.DataFrame,
    after: pd.DataFrame,
    matches: Sequence[Match],
    suites: Mapping[str, str],
    label: str = "",
) -> Contest:
    """Returns the contest of these columns.

    before, after: tables with one row a trial, or one and the same. suites: by scenario.
    """
    tables = []
    for side, table in enumerate((before, after)):
        parts = [
            table[table["controller"] == match[side]].assign(controller=match.name)
            for match in matches
        ]
        # Controllers without a partner are reported as not compared.
        other = set((after, before)[side]["controller"])
        taken = {match[side] for match in matches}
        parts += [
            table[table["controller"] == name]
            for name in dict.fromkeys(table["controller"])
            if name not in taken and name not in other
        ]
        chosen = pd.concat(parts, ignore_index=True) if parts else table.iloc[:0]
        tables.append(by_task(chosen, suites))
    return Contest(tables[0], tables[1], label)


def by_task(trials: pd.DataFrame, suites: Mapping[str, str]) -> pd.DataFrame:
    """Returns trials in which each task of a suite is one row, under the suite's name.

    Metrics are means over the trials of the task. It ended as an error, touched or did not arrive
    where one of its trials did. A suite of a single task stays as it is.
    """
    members: dict[str, list[str]] = {}
    for scenario in dict.fromkeys(trials["scenario"]):
        if scenario in suites:
            members.setdefault(suites[scenario], []).append(scenario)
    suite_of = {s: name for name, own in members.items() if len(own) > 1 for s in own}
    is_task = trials["scenario"].isin(list(suite_of))
    if not is_task.any():
        return trials
    numbers = [c for c in trials.select_dtypes("number") if c not in ("seed", "trial")]
    rows = []
    for (scenario, controller), own in trials[is_task].groupby(
        ["scenario", "controller"], sort=False
    ):
        rows.append(
            own.iloc[0].to_dict()
            | own[numbers].mean().to_dict()
            | {
                "scenario": suite_of[str(scenario)],
                "controller": controller,
                "seed": zlib.crc32(str(scenario).encode()),
                "outcome": _worst(list(own["outcome"])),
                "task": scenario,
            }
        )
    return pd.concat([trials[~is_task], pd.DataFrame(rows)], ignore_index=True)


def _worst(outcomes: Sequence[str]) -> str:
    for outcome in WORST_FIRST:
        if outcome in outcomes:
            return outcome
    failed = [outcome for outcome in outcomes if outcome != Outcome.SUCCEEDED]
    return failed[0] if failed else Outcome.SUCCEEDED
