"""leaderboard.html: ranks with ties, a card a controller, and the replays that belong to them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from drake_navbench.analysis.html import page_environment
from drake_navbench.analysis.leaderboard.entries import Entry, TrialName
from drake_navbench.analysis.leaderboard.ranking import Ranking, Standing, rank
from drake_navbench.analysis.leaderboard.suite import Suite
from drake_navbench.analysis.numbers import EMPTY, number
from drake_navbench.analysis.statistics import Interval
from drake_navbench.analysis.verdicts import is_failed
from drake_navbench.logs.results import file_name, require_writable
from drake_navbench.typed_files.dotted_names import flattened
from drake_navbench.typed_files.output_file import write_text

PAGE_NAME = "leaderboard.html"
REPLAYS = Path("replays")
DIGITS = 3


class Failure(NamedTuple):
    """A trial that did not reach its goal; replay: '' where it ended before its first sample."""

    scenario: str
    seed: int
    trial: int
    outcome: str
    reason: str
    replay: str


class Card(NamedTuple):
    """The content of a controller's card.

    replays: by scenario the link to its replay, '' where the scenario cannot have one.
    """

    standing: Standing
    intended_use: str
    controller: str
    digest: str
    parameters: dict[str, Any]
    software: dict[str, str]
    processors: tuple[str, ...]
    failures: tuple[Failure, ...]
    replays: dict[str, str]
    stand_ins: tuple[str, ...]


# Writes the replay of a log (first argument) to a page (second argument).
Render = Callable[[Path, Path], None]


def write_leaderboard(entries: Sequence[Entry], suite: Suite, out: Path, *, render: Render) -> Path:
    """Writes the page of a suite's entries and their replays into a new folder; returns its path.

    entries: as from `read_entries`. render: draws each replay from its log; an entry's own pages
    are never used, since they may contain anything. Raises InputError where the folder cannot be
    written to, or a log cannot be drawn.
    """
    require_writable(out)
    ranking = rank(pd.concat([entry.trials for entry in entries], ignore_index=True))
    # Two folders may have replays of the same names.
    replays = {
        entry.folder.path: _Replays(entry, out / REPLAYS / f"entry_{number}", render)
        for number, entry in enumerate(entries, start=1)
    }
    cards = [_card(standing, entries, suite, replays) for standing in ranking.standings]
    path = out / PAGE_NAME
    write_text(path, _render(ranking, cards, suite))
    return path


def _render(ranking: Ranking, cards: Sequence[Card], suite: Suite) -> str:
    environment = page_environment(card.controller for card in cards)
    environment.filters.update(
        number=partial(number, digits=DIGITS), interval=_interval, percent=_percent, ranks=_ranks
    )
    page = {
        "suite": suite,
        "groups": ranking.groups,
        "duels": ranking.duels,
        "cards": cards,
        "software_count": len({name for card in cards for name in card.software}),
    }
    return environment.get_template("leaderboard.html").render(page=page)


def _card(
    standing: Standing, entries: Sequence[Entry], suite: Suite, replays: Mapping[Path, _Replays]
) -> Card:
    name = standing.controller
    own = [entry for entry in entries if name in entry.controllers]
    preset = own[0].preset(name)
    machines = [
        machine
        for entry in own
        for key in ("cluster", "machines")
        for machine in entry.machines(key)
    ]
    stand_ins = own[0].manifest.get("stand_ins_of_columns", {}).get(name, ())
    return Card(
        standing=standing,
        intended_use=preset.description,
        controller=preset.controller,
        digest=own[0].digest(name),
        parameters=dict(flattened(preset.parameters)),
        software={entry.fingerprint: entry.software for entry in own},
        processors=tuple(dict.fromkeys(str(m.get("processor", "unknown")) for m in machines)),
        failures=tuple(
            failure
            for entry in own
            for failure in _failures(entry, name, replays[entry.folder.path])
        ),
        replays={
            scenario: replays[own[0].folder.path].link(own[0].shown(scenario, name))
            for scenario in suite.scenarios
        },
        stand_ins=tuple(stand_ins),
    )


def _failures(entry: Entry, controller: str, replays: _Replays) -> Iterator[Failure]:
    trials = entry.trials
    failed = trials[(trials["controller"] == controller) & is_failed(trials)]
    for row in failed.to_dict("records"):
        trial = TrialName(row["scenario"], controller, row["trial"])
        link = replays.link(trial if entry.can_be_shown(trial) else None)
        reason = str(row["reason"] or "")
        yield Failure(trial.scenario, entry.seed, trial.trial, row["outcome"], reason, link)


class _Replays:
    """The replays of an entry, each drawn from its log when it is first linked to.

    place: the replays' folder, below a folder beside the page.
    """

    def __init__(self, entry: Entry, place: Path, render: Render) -> None:
        self._entry = entry
        self._place = place
        self._render = render

    def link(self, trial: TrialName | None) -> str:
        """Returns the link to a trial's replay; '' without a replay."""
        if trial is None:
            return ""
        stem = "--".join(
            (file_name(trial.scenario), file_name(trial.controller), f"trial_{trial.trial:03d}")
        )
        page = self._place / f"{file_name(stem)}.html"
        if not page.exists():
            self._render(self._entry.folder.log_path(*trial), page)
        return page.relative_to(self._place.parents[1]).as_posix()


def _interval(bounds: Interval, scale: float = 1.0) -> str:
    if not bounds.low <= bounds.high:
        return EMPTY
    low, high = (number(scale * end, DIGITS) for end in bounds)
    return f"[{low}, {high}]"


def _percent(share: float) -> str:
    return f"{share:.0%}"


def _ranks(bounds: Interval) -> str:
    """Returns the interval of a rank in words."""
    low, high = int(bounds.low), int(bounds.high)
    return f"{low}" if low == high else f"{low} to {high}"
