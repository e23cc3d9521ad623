"""The critics' costs of DWB's chosen command and of others, as a table and in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.dwb.local_planner import NONE_CHOSEN, Evaluation
from drake_navbench.explanation import Cell, Explanation, command_text
from drake_navbench.kernels.arrays import Array

# Turn rates that differ by less are one way to turn, rad/s.
SAME_TURN_RADPS = 0.05
# Speeds that differ by a larger share of the fastest sample's are another speed.
SAME_SPEED_RATIO = 0.2
MOST_REASONS = 3


class _Shown(NamedTuple):
    """A trajectory that stands in the table; place: its index in the window."""

    title: str
    place: int


def explained(
    evaluation: Evaluation,
    critics: Sequence[str],
    rejections: Mapping[str, int],
    command: Array | None,
) -> Explanation:
    """Returns the reasons of a cycle's command.

    critics: names, in order. rejections: number of trajectories by 'critic/reason'. command: as
    the controller gives it; None where it gives none.
    """
    notes = _notes(evaluation, rejections)
    if evaluation.best == NONE_CHOSEN or command is None:
        count = len(evaluation.totals)
        sentence = f"DWB stops: none of its {count} trajectories is legal."
        return Explanation(None, sentence, *_rejected(rejections))
    costs = evaluation.raw_scores * evaluation.scales[:, None].astype(np.float64)
    costs = np.where(evaluation.scales[:, None] == 0.0, 0.0, costs)
    totals = np.where(_is_sound(evaluation), costs.sum(axis=0), np.inf)
    shown = _shown(evaluation, totals)
    twists = evaluation.trajectories.twists
    columns = ("critic", "scale", *(entry.title for entry in shown))
    rows: list[tuple[Cell, ...]] = [
        ("v [m/s]", None, *(float(twists[entry.place, 0]) for entry in shown)),
        ("w [rad/s]", None, *(float(twists[entry.place, 2]) for entry in shown)),
    ]
    if np.any(twists[:, 1] != 0.0):
        rows.insert(1, ("vy [m/s]", None, *(float(twists[e.place, 1]) for e in shown)))
    for c, name in enumerate(critics):
        scale = float(evaluation.scales[c])
        rows.append((name, scale, *(float(costs[c, entry.place]) for entry in shown)))
    rows.append(("total", None, *(float(totals[entry.place]) for entry in shown)))
    reason = _comparison(costs, totals, critics, shown, twists)
    sentence = f"DWB drives {command_text(command)}: {reason}{_refused(evaluation, critics)}."
    return Explanation(command, sentence, columns, tuple(rows), notes)


def _is_sound(evaluation: Evaluation) -> NDArray[np.bool_]:
    """(K,) whether no critic finds a rule broken, those that Nav2 would not have asked included."""
    return ~np.any(evaluation.violations != 0, axis=0)


def _shown(evaluation: Evaluation, totals: Array) -> list[_Shown]:
    """Returns the chosen trajectory, the next best, and the best that turn or drive otherwise."""
    best = evaluation.best
    twists = evaluation.trajectories.twists
    others = totals.copy()
    others[np.all(twists == twists[best], axis=1)] = np.inf
    shown = [_Shown("chosen", best)]
    if not np.isfinite(others).any():
        return shown
    shown.append(_Shown("next", int(np.argmin(others))))
    turning = np.sign(np.where(np.abs(twists[:, 2]) < SAME_TURN_RADPS, 0.0, twists[:, 2]))
    ahead = twists[:, 0] - twists[best, 0]
    margin = SAME_SPEED_RATIO * float(np.abs(twists[:, 0]).max())
    ways = {
        "left": (turning == 1.0) & (turning[best] != 1.0),
        "straight": (turning == 0.0) & (turning[best] != 0.0),
        "right": (turning == -1.0) & (turning[best] != -1.0),
        "slower": ahead < -margin,
        "faster": ahead > margin,
    }
    for title, members in ways.items():
        of_way = np.where(members, others, np.inf)
        if np.isfinite(of_way).any():
            shown.append(_Shown(title, int(np.argmin(of_way))))
    return shown


def _comparison(
    costs: Array, totals: Array, critics: Sequence[str], shown: Sequence[_Shown], twists: Array
) -> str:
    """Returns the words on the chosen trajectory against the best that turns another way."""
    best = shown[0].place
    total = f"{totals[best]:.4g}"
    if len(shown) == 1:
        return f"its total of {total} is the only one that breaks no rule"
    other = min(shown[2:] or shown[1:], key=lambda entry: totals[entry.place]).place
    ahead = costs[:, other] - costs[:, best]
    leading = [c for c in np.argsort(-ahead)[:MOST_REASONS] if ahead[c] > 0.0]
    if totals[other] == totals[best]:
        same = command_text(twists[other, [0, 2]])
        return f"total {total}, as {same}; of equal ones the one sampled first is taken"
    whose = "the best that turns or drives otherwise" if shown[2:] else "the next best"
    command = command_text(twists[other, [0, 2]])
    told = f"total {total} against {totals[other]:.4g} of {whose}, {command}"
    if not leading:
        return told
    first = [leading[0]]
    first += [c for c in leading[1:] if ahead[c] > 0.5 * ahead[leading[0]]]
    because = " and ".join(
        f"{critics[c]} ({costs[c, best]:.3g} against {costs[c, other]:.3g})" for c in first
    )
    return f"{told}, mostly by {because}"


def _refused(evaluation: Evaluation, critics: Sequence[str]) -> str:
    """Returns the words on faster trajectories where all of them break a rule, else ''."""
    speeds = evaluation.trajectories.twists[:, 0]
    faster = speeds > speeds[evaluation.best]
    if not faster.any() or np.any(faster & evaluation.is_legal):
        return ""
    by = sorted({critics[c] for c in evaluation.judged_counts[faster] - 1})
    return f"; {' and '.join(by)} refuses every faster one"


def _notes(evaluation: Evaluation, rejections: Mapping[str, int]) -> tuple[str, ...]:
    count = len(evaluation.totals)
    illegal = count - int(np.count_nonzero(evaluation.is_legal))
    told = f"{count} trajectories were sampled, {illegal} of them break a rule"
    if rejections:
        told += ": " + "; ".join(f"{number} {name}" for name, number in rejections.items())
    return (f"{told.rstrip('.')}.",)


def _rejected(
    rejections: Mapping[str, int],
) -> tuple[tuple[str, ...], tuple[tuple[Cell, ...], ...]]:
    """Returns columns and rows of the rules that no trajectory keeps."""
    rows = [(number, name) for name, number in rejections.items()]
    return ("trajectories", "rule that they break"), tuple(rows)
