"""Metrics of one trial, by theme. docs/metrics.md is generated from them.

A metric is a function from a `TrialLog` to a number, decorated with `@metric`. An entry point in
the group `drake_navbench.metrics` names a module of metrics, or a single metric; a user's metrics
are found in the same way as the built-in ones.
"""

from drake_navbench.analysis.metrics.definition import (
    Better,
    Measurement,
    Metric,
    Undefined,
    metric,
)

__all__ = ["Better", "Measurement", "Metric", "Undefined", "metric"]
