"""Probes driven on: a robot that gives up does so when its patience ends, perhaps after the probe.

Only drives that their time ended are driven on, so a robot that gives up there has given up: no
harsher world is made up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.outcome import Outcome
from drake_navbench.studies.doctor.driving import Row, probe_of
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.probes import LONGEST_S

# From the end of the patience to that of the task the robot may take so long, s.
AFTER_S = 5.0
# A longer drive takes too much of the budget, s.
MOST_S = 60.0


def driven_on(
    probes: Mapping[str, Scenario], rows: Sequence[Row], facts: Facts
) -> dict[str, Scenario]:
    """Returns the probes that their time ended, with time for the progress checker's patience.

    None of a way that is closed: there the robot is to give up.
    """
    patience_s = facts.number("progress_checker.movement_time_allowance", 10.0)
    time_s = min(LONGEST_S + patience_s + AFTER_S, MOST_S)
    ended = {probe_of(row) for row in rows if row["outcome"] == Outcome.TIMED_OUT}
    return {
        name: probe.model_copy(
            update={
                "timeout_s": time_s,
                "description": f"{probe.description}, driven on to {time_s:g} s",
            }
        )
        for name, probe in probes.items()
        if name in ended and probe.expected_outcome != "aborted"
    }
