"""The constraints that hold TEB's driven band, as a table and in words."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drake_navbench.controller import ControllerSetup, Decision
from drake_navbench.controllers.teb.band import Band
from drake_navbench.controllers.teb.choice import Attempt, BandChooser, Tried
from drake_navbench.controllers.teb.constraints import band_constraints
from drake_navbench.controllers.teb.layout import pack_band, row_slices
from drake_navbench.controllers.teb.memory import TebMemory
from drake_navbench.controllers.teb.parameters import TebParameters
from drake_navbench.controllers.teb.planner import BandPlanner, PlannedBand
from drake_navbench.explanation import Cell, Explanation, command_text
from drake_navbench.kernels.arrays import Array

COLUMNS = ("constraint", "bound", "at bound", "of", "first at [s]", "least room")
# A row counts as active within this share of its bound, or within this distance, in its unit.
ACTIVE_RATIO, ACTIVE = 0.01, 1e-3
UNITS = {
    "speed": "m/s",
    "turn_rate": "rad/s",
    "acceleration": "m/s^2",
    "angular_acceleration": "rad/s^2",
    "clearance": "m",
    "moving_clearance": "m",
    "turning": "m/s",
}
# Constraints that are active within this time from now shape the command, s.
SOON_S = 0.5


class Choice(NamedTuple):
    """A decision of the chooser, with its inputs; `tried`: the candidates with their bands."""

    attempt: Attempt
    band: Band
    tried: list[Tried]
    is_fallback: bool


class ListeningChooser(BandChooser):
    """A chooser that keeps its last choice.

    choice: the last one, None before there is any.
    """

    def __init__(
        self, parameters: TebParameters, setup: ControllerSetup, planner: BandPlanner
    ) -> None:
        super().__init__(parameters, setup, planner)
        self.choice: Choice | None = None

    def _decision(
        self,
        attempt: Attempt,
        band: Band,
        memory: TebMemory,
        tried: list[Tried],
        *,
        is_fallback: bool,
    ) -> Decision:
        self.choice = Choice(attempt, band, tried, is_fallback)
        return super()._decision(attempt, band, memory, tried, is_fallback=is_fallback)


class _Kind(NamedTuple):
    """The rows of one kind of constraint: how many are active, and when the first is, s."""

    name: str
    bound: str
    active: int
    total: int
    first_s: float | None
    margin: float


def explained(choice: Choice, command: Array) -> Explanation:
    """Returns the reasons of a command: the constraints that its band meets with equality."""
    told = command_text(command)
    if choice.is_fallback:
        sentence = (
            f"TEB drives {told}: none of {len(choice.tried)} bands obeys all limits, so it drives "
            "the rest of the last band, or brakes."
        )
        return Explanation(command, sentence, COLUMNS, ())
    planned = next(planned for _, planned in choice.tried if planned.band is choice.band)
    kinds = _kinds(planned)
    rows = tuple(_row(kind) for kind in kinds)
    active = [kind for kind in kinds if kind.active]
    soon = [kind for kind in active if kind.first_s is not None and kind.first_s <= SOON_S]
    if soon:
        names = " and ".join(f"{_words(kind)}" for kind in soon)
        reason = f"within {SOON_S:g} s its band is held by {names}"
    elif active:
        first = min(active, key=lambda kind: kind.first_s or 0.0)
        reason = f"the first limit on its band is the {_words(first)} in {first.first_s:.2g} s"
    else:
        reason = "no limit holds its band, only its duration counts"
    return Explanation(
        command, f"TEB drives {told}: {reason}.", COLUMNS, rows, _notes(choice, planned)
    )


def _words(kind: _Kind) -> str:
    return f"{kind.name.replace('_', ' ')} ({kind.bound})"


def _row(kind: _Kind) -> tuple[Cell, ...]:
    return (
        kind.name.replace("_", " "),
        kind.bound,
        kind.active,
        kind.total,
        kind.first_s,
        kind.margin,
    )


def _kinds(planned: PlannedBand) -> list[_Kind]:
    """Returns the kinds of constraints, in the order of the program's rows."""
    problem, band = planned.newton.problem, planned.band
    m = len(band.time_steps)
    scene, bounds = problem.scene, problem.bounds
    z = pack_band(band.poses, band.time_steps, planned.solution.slack)
    values, _ = band_constraints(z, m, scene)
    disc_count = len(scene.discs)
    slices = row_slices(m, disc_count, scene.turning_radius > 0.0, len(scene.encounters.things) > 0)
    times = np.concatenate([[0.0], np.cumsum(band.time_steps)])
    kinds = []
    for name, unit in UNITS.items():
        rows = slices[name]
        if rows.start == rows.stop:
            continue
        low, high, value = bounds.row_lower[rows], bounds.row_upper[rows], values[rows]
        margins = np.minimum(value - low, high - value)
        limit = np.where(np.isfinite(high), high, low)
        active = np.flatnonzero(margins <= np.maximum(ACTIVE_RATIO * np.abs(limit), ACTIVE))
        first_s = None
        if active.size:
            # Rows of clearance are those of inner poses, one for each disc.
            pose = active[0] // disc_count + 1 if "clearance" in name else active[0]
            first_s = float(times[min(pose, m)])
        kinds.append(
            _Kind(
                name,
                _bound(low, high, unit),
                len(active),
                len(value),
                first_s,
                float(margins.min()),
            )
        )
    return kinds


def _bound(low: Array, high: Array, unit: str) -> str:
    least, most = float(low[np.isfinite(low)].max(initial=-np.inf)), float(high.min())
    if not np.isfinite(most):
        return f"at least {least:.3g} {unit}"
    if least == -most:
        return f"+-{most:.3g} {unit}"
    return f"{least:.3g} to {most:.3g} {unit}"


def _notes(choice: Choice, planned: PlannedBand) -> tuple[str, ...]:
    """Returns sentences on the clearance that is given up, the block and the other bands."""
    notes = []
    slack = planned.solution.slack + planned.given_up_m
    wanted = choice.attempt.task.limits.clearance
    if slack > ACTIVE:
        notes.append(
            f"Where the way is narrow the band may give up {slack:.2g} m of the {wanted:.3g} m "
            "that it should keep off obstacles."
        )
    if choice.attempt.is_blocked:
        notes.append("The plan is blocked: the band ends before the block.")
    accepted = [band for _, band in choice.tried if band.accepted]
    others = sorted(band.band.duration_s for band in accepted if band is not planned)
    tried, obey = len(choice.tried), len(accepted)
    told = f"{tried} band{' was' if tried == 1 else 's were'} tried, {obey} of them obey"
    told += f"{'s' if obey == 1 else ''} all limits"
    told += f"; the driven one takes {planned.band.duration_s:.3g} s"
    if others:
        told += f", the next {others[0]:.3g} s"
    return (*notes, f"{told}.")
