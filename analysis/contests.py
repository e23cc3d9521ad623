"""Pairs of columns whose trials are compared: of two tables, of one table, or by tasks of a suite.

The tasks of a suite, such as the goals that are drawn on a map, count as one scenario in which each
task is one pair: trials of one task are not independent of each other.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drake_navbench.analysis.paired_trials import IDENTITY, Contest
from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.logs.outcome import FROM_WORST

ARROW = " -> "


class Match(NamedTuple):
    """A column of the base (`old`), and the column that is judged against it (`new`)."""

    old: str
    new: str

    @property
    def name(self) -> str:
        """The name under which both are compared, 'old -> new'."""
        return self.old if self.old == self.new else f"{self.old}{ARROW}{self.new}"


# Alias of a run's whole Nav2 file -> plugin -> column.
Files = Mapping[str, Mapping[str, str]]


def matches_between(
    before: Sequence[str],
    after: Sequence[str],
    requested: Sequence[Match] = (),
    files: tuple[Files, Files] = ({}, {}),
) -> list[Match]:
    """Returns the pairs of columns, one of each folder, that are compared.

    Each rule looks at the columns that the rules before it have left over:
    - The pairs in `requested`.
    - Columns of equal name.
    - Columns of the same plugin from files of the same alias: `old/FollowPath` of a run of one file
      is `old` in a run of several.
    - Columns of the same plugin, if the remaining columns come from one file in each folder.
    - The only remaining column in each folder.
    files: one for each folder, see `Files`. Raises InputError where a column in `requested` does
    not exist.
    """
    _require_known([match.old for match in requested], before)
    _require_known([match.new for match in requested], after)
    places = [
        {column: (alias, plugin) for alias, own in side.items() for plugin, column in own.items()}
        for side in files
    ]
    found = list(requested)

    def left() -> list[list[str]]:
        return [
            [name for name in names if name not in {match[side] for match in found}]
            for side, names in enumerate((before, after))
        ]

    def pair(keys: Sequence[Mapping[str, object]]) -> None:
        old, new = left()
        by_key = {keys[1][name]: name for name in new if name in keys[1]}
        found.extend(Match(n, by_key[keys[0][n]]) for n in old if keys[0].get(n) in by_key)

    pair([{name: name for name in names} for names in (before, after)])
    pair(places)
    plugins = [
        {name: place[1] for name, place in own.items() if name in names}
        for own, names in zip(places, left(), strict=True)
    ]
    aliases = [
        {own[name][0] for name in names if name in own}
        for own, names in zip(places, left(), strict=True)
    ]
    if all(len(own) == 1 for own in aliases):
        pair(plugins)
    old, new = left()
    return [*found, Match(old[0], new[0])] if len(old) == len(new) == 1 else found


def matches_within(
    columns: Sequence[str], files: Files, requested: Sequence[Match] = ()
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
    # A manifest lists the files by the alphabet; the first file is the file of the first column.
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

    before, after: the names of the existing columns. A name may contain equals signs, such as that
    of a variant: the text is split where both parts are columns.
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
        raise InputError(f"--match {text!r}: means {told}; rename a column by --name")
    # Neither split fits: take one with one known name, so that the error names the other.
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

    before, after: tables with one row a trial; may be the same table. suites: by scenario. Of a
    task that both drove, only the trials with equal seeds count: a task that is driven more often
    has more trials in which something can go wrong.
    """
    tables = matched_trials(before, after, matches)
    driven = [_of_tasks(table, suites) for table in tables]
    common = [
        _rows_in(own, other, IDENTITY) | ~_rows_in(own, other, IDENTITY[:2])
        for own, other in (driven, driven[::-1])
    ]
    own_before, own_after = (
        by_task(table.drop(own.index[~kept]), suites)
        for table, own, kept in zip(tables, driven, common, strict=True)
    )
    return Contest(own_before, own_after, label)


def matched_trials(
    before: pd.DataFrame, after: pd.DataFrame, matches: Sequence[Match]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Returns the trials of both tables; matched columns have the names of their matches.

    Columns without a partner keep theirs; they are reported as not compared.
    """
    tables = []
    for side, table in enumerate((before, after)):
        parts = [
            table[table["controller"] == match[side]].assign(controller=match.name)
            for match in matches
        ]
        other = set((after, before)[side]["controller"])
        taken = {match[side] for match in matches}
        parts += [
            table[table["controller"] == name]
            for name in dict.fromkeys(table["controller"])
            if name not in taken and name not in other
        ]
        tables.append(pd.concat(parts, ignore_index=True) if parts else table.iloc[:0])
    return tables[0], tables[1]


def _of_tasks(trials: pd.DataFrame, suites: Mapping[str, str]) -> pd.DataFrame:
    """Returns the trials of the tasks of suites of several tasks."""
    own = [suites[name] for name in dict.fromkeys(trials["scenario"]) if name in suites]
    several = {scenario for scenario, suite in suites.items() if own.count(suite) > 1}
    return trials[trials["scenario"].isin(list(several))]


def _rows_in(trials: pd.DataFrame, other: pd.DataFrame, columns: list[str]) -> NDArray[np.bool_]:
    """Returns for each trial whether another table has one that is equal in these columns."""
    return pd.MultiIndex.from_frame(trials[columns]).isin(pd.MultiIndex.from_frame(other[columns]))


def by_task(trials: pd.DataFrame, suites: Mapping[str, str]) -> pd.DataFrame:
    """Returns trials in which each task of a suite is one row, under the suite's name.

    Metrics are means over the trials of the task. A task counts as an error, as touching or as not
    arrived if one of its trials does. A suite of a single task stays as it is.
    """
    tasks = _of_tasks(trials, suites)
    if tasks.empty:
        return trials
    numbers = [c for c in trials.select_dtypes("number") if c not in ("seed", "trial")]
    rows = []
    for (scenario, controller), own in tasks.groupby(["scenario", "controller"], sort=False):
        rows.append(
            own.iloc[0].to_dict()
            | own[numbers].mean().to_dict()
            | {
                "scenario": suites[str(scenario)],
                "controller": controller,
                "seed": zlib.crc32(str(scenario).encode()),
                "outcome": min(own["outcome"], key=FROM_WORST.index),
                "task": scenario,
            }
        )
    return pd.concat([trials.drop(tasks.index), pd.DataFrame(rows)], ignore_index=True)
