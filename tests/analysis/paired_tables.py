"""Tables of trials drawn from laws that are known, for paired tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from drake_navbench.analysis.metrics.registry import all_metrics

METRICS = [m for m in all_metrics() if m.is_repeatable and m.name != "success_rate"]


@dataclass(frozen=True)
class Law:
    """How a controller drives a scenario.

    aborts, touches, errors: probabilities of a trial. shift: added to every metric, in standard
    deviations of a metric between seeds.
    """

    aborts: float = 0.0
    touches: float = 0.0
    errors: float = 0.0
    shift: float = 0.0


def draw(
    random: np.random.Generator, laws: Sequence[Law], pairs: int, metrics: Sequence[str]
) -> pd.DataFrame:
    """Returns the trials of one run: a cell a law, `pairs` seeds each.

    Half of a metric's variance is the run's own. Metrics of a trial are correlated by a half, and
    their noise has heavy tails.
    """
    tables = []
    seeds = np.arange(pairs)
    for number, law in enumerate(laws):
        of_seed = np.random.default_rng(number).standard_normal((pairs, len(metrics)))
        own = random.standard_t(4, size=(pairs, len(metrics) + 1)) / np.sqrt(2.0)
        noise = np.sqrt(0.5) * (own[:, 1:] + own[:, :1])
        values = 10.0 + law.shift + np.sqrt(0.5) * (of_seed + noise)
        drawn = random.uniform(size=pairs)
        outcome = np.select(
            [
                drawn < law.errors,
                drawn < law.errors + law.touches,
                drawn < law.errors + law.touches + law.aborts,
            ],
            ["error", "collided", "aborted"],
            "succeeded",
        )
        table = pd.DataFrame(values, columns=list(metrics))
        who = {"scenario": f"scenario_{number // 2}", "controller": f"controller_{number % 2}"}
        tables.append(table.assign(**who, seed=seeds, outcome=outcome))
    return pd.concat(tables, ignore_index=True)
