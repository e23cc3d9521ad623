"""The critics' costs of MPPI's samples, grouped by direction, as a table and in words.

MPPI drives no single sample but the mean of all, weighted by exp(-cost / temperature). So the
samples are shown in groups: as the mean drives, further left or right, faster, slower. A group has
the mean of its samples' costs under these weights.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controllers.mppi.motion_models import VX, WZ
from drake_navbench.controllers.mppi.sampler import CycleResult
from drake_navbench.explanation import Cell, Explanation, command_text
from drake_navbench.kernels.arrays import Array

# Mean turn rates that differ by less from the chosen one lead the same way, rad/s.
SAME_TURN_RADPS = 0.1
# Speeds that differ by a larger share of the fastest sample's are another speed.
SAME_SPEED_RATIO = 0.2
EVEN = "control effort"
CHOSEN = "as chosen"
WORDS = {"left": "farther left", "right": "farther right", "faster": "faster", "slower": "slower"}


def explained(result: CycleResult, critics: Sequence[str], command: Array) -> Explanation:
    """Returns the reasons of a sampled cycle's command, before any polish.

    result: with the batch of samples. critics: names, in order.
    """
    assert result.batch is not None
    weights = result.weights.astype(np.float64)
    costs = result.critic_costs.astype(np.float64)
    totals = result.costs.astype(np.float64)
    velocities = result.batch.velocities.astype(np.float64).mean(axis=1)
    # The rest of the costs, beside the critics', is the price of leaving the last sequence, and the
    # costs of the passes before the last one.
    costs = np.vstack([costs, totals - costs.sum(axis=0)])
    names = [*critics, EVEN]
    groups = _groups(velocities, weights @ velocities)
    shares = np.stack([_shares(weights, totals, members) for _, members in groups])
    means = costs @ shares.T
    columns = ("critic", *(title for title, _ in groups))
    rows: list[tuple[Cell, ...]] = [
        ("mean v [m/s]", *map(float, shares @ velocities[:, VX])),
        ("mean w [rad/s]", *map(float, shares @ velocities[:, WZ])),
        ("samples", *(len(members) for _, members in groups)),
        ("share of the weight", *(float(weights[members].sum()) for _, members in groups)),
    ]
    rows += [(name, *map(float, means[c])) for c, name in enumerate(names)]
    rows.append(("total", *map(float, means.sum(axis=0))))
    titles = [title for title, _ in groups]
    sentence = f"MPPI drives {command_text(command)}: {_comparison(means, names, titles)}."
    effective = 1.0 / float(np.sum(weights**2))
    note = (
        f"{len(totals)} samples; the weights are as even as those of {effective:.0f} equal ones. "
        "A column is the mean of its samples under these weights."
    )
    return Explanation(command, sentence, columns, tuple(rows), (note,))


def polished(sampled: Explanation, command: Array) -> Explanation:
    """Returns the reasons of a sampled command, and how the polish changed it to `command`."""
    if sampled.gives(command):
        note = "The polish kept the sampled sequence."
        return sampled._replace(command=command, notes=(*sampled.notes, note))
    was = command_text(np.asarray(sampled.command))
    sentence = (
        f"{sampled.sentence[:-1]}; the nonlinear program makes of it {command_text(command)}."
    )
    note = f"The critics judged the samples, whose mean is {was}; the polish has costs of its own."
    return sampled._replace(command=command, sentence=sentence, notes=(*sampled.notes, note))


def _groups(velocities: Array, chosen: Array) -> list[tuple[str, NDArray[np.int64]]]:
    """Returns the samples that lead as the chosen, to its left or right, faster and slower."""
    turn = velocities[:, WZ] - chosen[WZ]
    same_way = np.abs(turn) <= SAME_TURN_RADPS
    margin = SAME_SPEED_RATIO * float(np.abs(velocities[:, VX]).max(initial=0.0))
    faster = velocities[:, VX] - chosen[VX]
    flags = {
        CHOSEN: same_way & (np.abs(faster) <= margin),
        "left": turn > SAME_TURN_RADPS,
        "right": turn < -SAME_TURN_RADPS,
        "faster": same_way & (faster > margin),
        "slower": same_way & (faster < -margin),
    }
    return [(name, np.flatnonzero(flag)) for name, flag in flags.items() if flag.any()]


def _shares(weights: Array, totals: Array, members: NDArray[np.int64]) -> Array:
    """Returns (B,) the weights of a group's samples, their sum 1.

    Where all of them are 0, the cheapest sample of the group gets 1.
    """
    shares = np.zeros(len(weights))
    shares[members] = weights[members]
    if shares.sum() == 0.0:
        shares[members[np.argmin(totals[members])]] = 1.0
    return shares / shares.sum()


def _comparison(means: Array, names: Sequence[str], titles: Sequence[str]) -> str:
    """Returns the words on the chosen group against the cheapest other one.

    means: (critics, groups) of the costs.
    """
    totals = means.sum(axis=0)
    if CHOSEN not in titles:
        return "no sample leads as their mean does"
    chosen = titles.index(CHOSEN)
    others = [k for k in range(len(titles)) if k != chosen]
    told = f"such samples cost {totals[chosen]:.3g}"
    if not others:
        return f"{told}, and none leads elsewhere"
    other = min(others, key=lambda k: totals[k])
    told += f", those that lead {WORDS[titles[other]]} {totals[other]:.3g}"
    sign = 1.0 if totals[other] >= totals[chosen] else -1.0
    ahead = sign * (means[:, other] - means[:, chosen])
    first = int(np.argmax(ahead))
    if ahead[first] <= 0.0:
        return told
    numbers = f"{means[first, chosen]:.3g} against {means[first, other]:.3g}"
    return f"{told}, mostly by {names[first]} ({numbers})"
