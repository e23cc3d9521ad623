"""Recorded people, who walk on the tracks of a recording."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.errors import InputError
from drake_navbench.inputs.people import MAX_PEOPLE, Person, Recording
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.moving_bodies import FAR_AWAY_M, Tracks
from drake_navbench.kernels.recorded_walks import KNOT_SIZE, headings, people_on_tracks
from drake_navbench.typed_files.input_file import MEGABYTE, read_input_text

MAX_RECORDING_BYTES = 64 * MEGABYTE
CSV_HEADER = ("time_s", "person", "x_m", "y_m")
MAX_PLACE_M = 1e5


class Row(NamedTuple):
    """A person's position at a time, in the recording's own frame; line: in the file."""

    line: int
    time_s: float
    x_m: float
    y_m: float


@dataclass(frozen=True)
class RecordedPeople:
    """The people of a recording who are in the world during a trial.

    names, groups: name and group of each person; group -1: alone. radius_m: radius of all bodies.
    knots: (K, 5) of all people, see `kernels.recorded_walks`, in the world's frame and the trial's
    time. firsts: (P + 1,) each person's first row. lines: (K,) the line of each knot in the file.
    """

    names: list[str]
    groups: list[int]
    radius_m: float
    knots: Array
    firsts: NDArray[np.int64]
    lines: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.names)

    @classmethod
    def known_by(cls, names: list[str], groups: list[int], radius_m: float) -> RecordedPeople:
        """Returns people with names, groups and radius alone, without tracks."""
        nothing = np.zeros(0, dtype=np.int64)
        firsts = np.zeros(len(names) + 1, dtype=np.int64)
        return cls(names, groups, radius_m, np.empty((0, KNOT_SIZE)), firsts, nothing)

    @property
    def persons(self) -> tuple[Person, ...]:
        """Empty: no recorded person walks by a model."""
        return ()

    @cached_property
    def radii_m(self) -> Array:
        """(P,) the radii of the discs that stand for the people's bodies, m."""
        return np.full(len(self.names), self.radius_m)

    @cached_property
    def tracks(self) -> Tracks:
        """The people's tracks; while away from the world, a person is at FAR_AWAY_M."""
        rows = np.ascontiguousarray(self.knots[:, :4])
        return Tracks(rows, self.firsts, np.zeros(len(self)))

    @cached_property
    def top_speed_mps(self) -> float:
        """The largest speed of anyone in the recording, m/s."""
        here, there = self.knots[:-1], self.knots[1:]
        steps_s, steps_m = there[:, 0] - here[:, 0], np.hypot(*(there[:, 1:3] - here[:, 1:3]).T)
        # Steps to and from FAR_AWAY_M, and to the next person's rows, are no walks.
        walks = (steps_s > 0.0) & (here[:, 1] < FAR_AWAY_M) & (there[:, 1] < FAR_AWAY_M)
        return float((steps_m[walks] / steps_s[walks]).max(initial=0.0))

    @cached_property
    def appearances_s(self) -> Array:
        """The times, in order, at which people come into the world after the start, s."""
        away = self.knots[:, 1] >= FAR_AWAY_M
        comes = ~away[1:] & away[:-1]
        times_s = self.knots[1:, 0][comes]
        return np.unique(times_s[times_s > 0.0])

    def people_at(self, time_s: float) -> Array:
        """Returns (P, 8) all people's states at a time, s; see `kernels.walking`."""
        return people_on_tracks(self.knots, self.firsts, time_s)

    def line_at(self, person: int, time_s: float) -> int:
        """Returns the line in the file of a person's last row up to a time."""
        rows = slice(self.firsts[person], self.firsts[person + 1])
        past = int(np.searchsorted(self.knots[rows, 0], time_s, side="right"))
        return int(self.lines[rows][max(past - 1, 0)])

    def ways(self) -> Iterator[tuple[int, int, Array]]:
        """Yields person, line and ends (2, 2) m of every straight piece that is walked."""
        for person in range(len(self)):
            for row in range(self.firsts[person], self.firsts[person + 1] - 1):
                ends = self.knots[row : row + 2, 1:3]
                if (ends < FAR_AWAY_M).all():
                    yield person, int(self.lines[row + 1]), ends


def load_recording(path: Path, settings: Recording, duration_s: float) -> RecordedPeople:
    """Reads the people of a recording who are in the world during a trial of `duration_s`.

    Raises InputError, one line with file and line, where the file cannot be read, or a person's
    times do not rise or positions jump.
    """
    tracks = {
        name: list(_in_trial(path, name, rows, settings))
        for name, rows in _read_rows(path, settings).items()
    }
    known = set(tracks)
    there = {name: rows for name, rows in tracks.items() if _is_there(rows, settings, duration_s)}
    if len(there) > MAX_PEOPLE:
        raise InputError(
            f"{path}: {len(there)} people during the trial, expected at most {MAX_PEOPLE}"
        )
    groups = _groups(path, known, list(there), settings)
    if not there:
        return RecordedPeople.known_by([], [], settings.radius_m)
    knots, lines = zip(*(_knots(rows, settings) for rows in there.values()), strict=True)
    return RecordedPeople(
        list(there),
        groups,
        settings.radius_m,
        np.vstack(knots),
        np.cumsum([0, *map(len, knots)]).astype(np.int64),
        np.concatenate(lines),
    )


def _read_rows(path: Path, settings: Recording) -> dict[str, list[Row]]:
    """Returns the rows of each person, in the order of the file."""
    text = read_input_text(path, max_bytes=MAX_RECORDING_BYTES)
    is_csv = settings.format == "csv"
    rows: dict[str, list[Row]] = {}
    for line, content in enumerate(text.splitlines(), start=1):
        fields = [field.strip() for field in content.split(",")] if is_csv else content.split()
        if not any(fields):
            continue
        if is_csv and not rows and line == 1:
            if tuple(fields) != CSV_HEADER:
                raise InputError(
                    f"{path}, line 1: expected the header {','.join(CSV_HEADER)}, got "
                    f"{content[:60]!r}"
                )
            continue
        if len(fields) != 4:
            columns = ",".join(CSV_HEADER) if is_csv else "frame person x y"
            raise InputError(
                f"{path}, line {line}: expected 4 columns, {columns}, got {len(fields)}"
            )
        name = fields[1] if is_csv else _whole(fields[1])
        time, x, y = (_number(path, line, fields[column]) for column in (0, 2, 3))
        time_s = time if settings.frame_rate_hz is None else time / settings.frame_rate_hz
        rows.setdefault(name, []).append(Row(line, time_s, x, y))
    if not rows:
        raise InputError(f"{path}: expected rows, found none")
    return rows


def _whole(name: str) -> str:
    """Returns a person's number without a decimal point and zeros, as some files write it."""
    return name.partition(".")[0] if name.rstrip("0").endswith(".") else name


def _number(path: Path, line: int, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= MAX_PLACE_M * 1e3:
        raise InputError(f"{path}, line {line}: expected a number, got {text[:40]!r}")
    return value


def _in_trial(path: Path, name: str, rows: Sequence[Row], settings: Recording) -> Iterator[Row]:
    """Yields a person's rows in the world's frame and the trial's time; checks them."""
    cos_yaw, sin_yaw = math.cos(settings.yaw_rad), math.sin(settings.yaw_rad)
    before: Row | None = None
    for row in rows:
        place = f"{path}, line {row.line}: person {name}"
        if max(abs(row.x_m), abs(row.y_m)) > MAX_PLACE_M:
            raise InputError(f"{place} is at [{row.x_m:g}, {row.y_m:g}] m; expected places in m")
        if before is not None:
            step_s = row.time_s - before.time_s
            if step_s <= 0.0:
                raise InputError(
                    f"{place} has the time {row.time_s:g} s after {before.time_s:g} s in line "
                    f"{before.line}; expected rising times"
                )
            speed_mps = math.dist(row[2:], before[2:]) / step_s
            if step_s <= settings.max_gap_s and speed_mps > settings.max_speed_mps:
                raise InputError(
                    f"{place} jumps {math.dist(row[2:], before[2:]):.2f} m in {step_s:.3g} s, "
                    f"{speed_mps:.3g} m/s; expected at most recording.max_speed_mps "
                    f"{settings.max_speed_mps:g}"
                )
        yield Row(
            row.line,
            row.time_s - settings.start_time_s,
            settings.origin[0] + cos_yaw * row.x_m - sin_yaw * row.y_m,
            settings.origin[1] + sin_yaw * row.x_m + cos_yaw * row.y_m,
        )
        before = row


def _spells(rows: Sequence[Row], settings: Recording) -> Iterator[list[Row]]:
    """Yields the rows of each of a person's stays in the world; a single row is no stay."""
    spell: list[Row] = []
    for row in rows:
        if spell and row.time_s - spell[-1].time_s > settings.max_gap_s:
            if len(spell) > 1:
                yield spell
            spell = []
        spell.append(row)
    if len(spell) > 1:
        yield spell


def _is_there(rows: Sequence[Row], settings: Recording, duration_s: float) -> bool:
    """Returns whether a person is in the world during a trial."""
    return any(
        spell[0].time_s < duration_s and spell[-1].time_s > 0.0 for spell in _spells(rows, settings)
    )


def _knots(rows: Sequence[Row], settings: Recording) -> tuple[Array, NDArray[np.int64]]:
    """Returns a person's knots (K, 5) and their lines in the file (K,)."""
    knots: list[Array] = []
    lines: list[int] = []
    walked_m = 0.0
    for spell in _spells(rows, settings):
        own = np.zeros((len(spell) + 2, KNOT_SIZE))
        own[1:-1, 0] = [row.time_s for row in spell]
        own[1:-1, 1] = [row.x_m for row in spell]
        own[1:-1, 2] = [row.y_m for row in spell]
        own[1:-1, 3] = headings(own[1:-1, :3])
        steps_m = np.hypot(*np.diff(own[1:-1, 1:3], axis=0).T)
        own[1:-1, 4] = walked_m + np.concatenate([[0.0], np.cumsum(steps_m)])
        walked_m = own[-2, 4]
        # Before and after the stay the person is FAR_AWAY_M.
        own[0, 0], own[-1, 0] = own[1, 0], own[-2, 0]
        own[[0, -1], 1:3] = FAR_AWAY_M
        knots.append(own)
        lines += [spell[0].line, *(row.line for row in spell), spell[-1].line]
    return np.vstack(knots), np.array(lines, dtype=np.int64)


def _groups(path: Path, known: set[str], names: list[str], settings: Recording) -> list[int]:
    """Returns the group of each name, -1 where it is in none."""
    groups = dict.fromkeys(names, -1)
    for number, members in enumerate(settings.groups):
        for member in members:
            if member not in known:
                raise InputError(f"{path}: recording.groups[{number}]: nobody is called {member!r}")
            if groups.get(member, -1) >= 0:
                raise InputError(
                    f"{path}: recording.groups: {member!r} is in two groups, expected one"
                )
            if member in groups:
                groups[member] = number
    return list(groups.values())
