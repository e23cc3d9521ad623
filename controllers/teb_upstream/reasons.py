"""The penalties of the original TEB's driven band and of the best other, in words and as a table.

A penalty above zero is a limit that the band breaks, or comes nearer to than penalty_epsilon: the
original has no constraints.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from drake_navbench.controllers.teb_upstream.memory import Trajectory
from drake_navbench.explanation import Explanation, Row, command_text
from drake_navbench.kernels.arrays import Array

MOST_NAMED = 3
# Every band has these, whatever it meets.
ALWAYS = ("time", "length")


def explained(
    command: Array, bands: Sequence[Trajectory], penalties: Sequence[Mapping[str, float]]
) -> Explanation:
    """Returns the reasons of a command.

    bands: the driven one, and the best other one where there is any. penalties: penalties of each,
    by kind.
    """
    columns = ("penalty", "driven", "best other")[: 1 + len(bands)]
    rows: list[Row] = [
        (kind, *(found[kind] for found in penalties))
        for kind in penalties[0]
        if any(found[kind] > 0.0 for found in penalties)
    ]
    rows.append(("sum", *(sum(found.values()) for found in penalties)))
    rows.append(("compared by", *(float(band.cost) for band in bands)))
    rows.append(("duration [s]", *(band.duration_s for band in bands)))
    own = penalties[0]
    met = sorted(
        (kind for kind in own if kind not in ALWAYS and own[kind] > 0.0), key=own.__getitem__
    )
    named = " and ".join(f"{kind} ({own[kind]:.3g})" for kind in met[::-1][:MOST_NAMED])
    told = f"its band pays for {named}" if named else "its band pays for its time alone"
    if len(bands) > 1:
        told += f"; it costs {bands[0].cost:.4g} against {bands[1].cost:.4g} of the best other band"
    sentence = f"TEB drives {command_text(command)}: {told}."
    return Explanation(command, sentence, columns, tuple(rows))
