"""The publication's tables and findings as data.

Source: F. Schena, "Development of an automated benchmark for the analysis of Nav2 controllers",
Politecnico di Torino, 2024.
"""

from __future__ import annotations

from functools import lru_cache
from importlib.resources import files
from io import StringIO
from typing import Any

import pandas as pd

PUBLISHED_CONTROLLERS = ("dwb", "rpp", "teb", "mppi")


@lru_cache(maxsize=1)
def published_table() -> pd.DataFrame:
    """Returns tables 4.1 to 4.5: scenario, metric, unit, then one column a controller."""
    return _packaged_csv("published_tables.csv")


@lru_cache(maxsize=1)
def published_units() -> dict[tuple[str, str], float]:
    """Returns the last printed digit's unit by (scenario, metric): 0.001 for 0.62 beside 0.868.

    A row is printed to as many digits as the longest of its numbers shows.
    """
    text = _packaged_csv("published_tables.csv", dtype=str)
    printed = text[list(PUBLISHED_CONTROLLERS)].map(lambda cell: len(cell.partition(".")[2]))
    digits = printed.max(axis=1)
    return {
        (scenario, metric): 10.0 ** -int(count)
        for scenario, metric, count in zip(text["scenario"], text["metric"], digits, strict=True)
    }


@lru_cache(maxsize=1)
def published_findings() -> pd.DataFrame:
    """Returns the publication's claims: id, scenario, metric, relation, controllers, where."""
    return _packaged_csv("findings.csv")


def _packaged_csv(name: str, **options: Any) -> pd.DataFrame:
    text = files("drake_navbench.analysis.reproduction").joinpath(name).read_text(encoding="utf-8")
    return pd.read_csv(StringIO(text), **options)
