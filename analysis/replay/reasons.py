"""The reasons of a controller's decisions as the page of a replay shows them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from drake_navbench.explanation import Explanation
from drake_navbench.logs.text_tables import cell_text


class Decision(Protocol):
    """One decision with its reasons, as `drake_navbench.trial.why` finds them.

    time_s: start of the control cycle, s. assurance: how sure it is that these are the reasons of
    the logged decision.
    """

    @property
    def time_s(self) -> float: ...

    @property
    def explanation(self) -> Explanation: ...

    @property
    def assurance(self) -> tuple[str, ...]: ...


def shown_reasons(decisions: Sequence[Decision]) -> list[dict[str, Any]]:
    """Returns each decision's time, sentence, table and notes, with numbers as text."""
    return [
        {
            "time": round(decision.time_s, 6),
            "sentence": decision.explanation.sentence,
            "columns": list(decision.explanation.columns),
            "rows": [[cell_text(cell) for cell in row] for row in decision.explanation.rows],
            "notes": [*decision.explanation.notes, *decision.assurance],
        }
        for decision in decisions
    ]
