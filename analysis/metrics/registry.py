"""Finds the installed metrics, the built-in ones and a user's alike, by entry point."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from functools import cache
from types import ModuleType

from drake_navbench.analysis.metrics.definition import Measurement, Metric
from drake_navbench.analysis.metrics.metric_file import asked_metrics, metric_in_file, remember
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.logs.log import TrialLog
from drake_navbench.plugins.kinds import PluginKind

METRICS = PluginKind(noun="metric", group="drake_navbench.metrics", guide="docs/metrics.md")
# The theme of metrics that are given with `--metric`.
OWN_THEME = "your own"
# The order of the catalogue and of the columns; a user's themes follow by name.
BUILTIN_THEMES = (
    "published",
    "efficiency",
    "tracking",
    "safety",
    "moving",
    "social",
    "smoothness",
    "comfort",
    "compute",
)


def installed_metrics() -> Mapping[str, tuple[Metric, ...]]:
    """Returns the metrics by theme (the entry point's name), the built-in themes first.

    Metrics from files (`--metric`) come last.
    """
    own = asked_metrics()
    return packaged_metrics() | ({OWN_THEME: own} if own else {})


@cache
def packaged_metrics() -> dict[str, tuple[Metric, ...]]:
    """Returns the metrics of packages by theme, the built-in themes first.

    A theme is left out with a warning if it cannot be loaded, or if it has a metric of the same
    name as another theme.
    """
    loaded = METRICS.load_all(lambda theme, plugin: metrics_in(plugin, theme))
    order = [theme for theme in BUILTIN_THEMES if theme in loaded]
    order += sorted(set(loaded) - set(order))
    by_theme: dict[str, tuple[Metric, ...]] = {}
    owner: dict[str, str] = {}
    for theme in order:
        doubled = [entry.name for entry in loaded[theme] if entry.name in owner]
        if doubled:
            name = doubled[0]
            warnings.warn(
                f"metric {name!r} of theme {theme!r} is defined by {owner[name]!r} already; "
                f"{theme!r} is left out",
                InputWarning,
                stacklevel=1,
            )
            continue
        by_theme[theme] = loaded[theme]
        owner |= dict.fromkeys((entry.name for entry in loaded[theme]), theme)
    return by_theme


def use_metric_files(references: Sequence[str]) -> None:
    """Adds the metrics of `--metric FILE.py:NAME` to the measured ones.

    Raises InputError where one cannot be loaded, or has the name of another metric.
    """
    found = [metric_in_file(reference) for reference in references]
    remember([])
    taken = [entry.name for entry in all_metrics()]
    for entry, reference in zip(found, references, strict=True):
        if entry.name in taken:
            raise InputError(f"--metric {reference}: a metric {entry.name!r} exists already")
        taken.append(entry.name)
    remember(references)


def metrics_in(loaded: ModuleType | Metric, theme: str) -> tuple[Metric, ...]:
    """Returns the metrics at an entry point: a module's metrics in order, or the single metric."""
    if isinstance(loaded, Metric):
        return (loaded,)
    found = vars(loaded).values() if isinstance(loaded, ModuleType) else ()
    # A module may import metrics from another one; only its own metrics count.
    own = tuple(
        value
        for value in found
        if isinstance(value, Metric) and value.function.__module__ == loaded.__name__
    )
    if not own:
        raise InputError(
            f"metric {theme!r}: its entry point in {METRICS.group} names {loaded!r}; "
            "expected a function decorated with @metric, or a module with some"
        )
    return own


def all_metrics() -> tuple[Metric, ...]:
    """Returns every installed metric in the order of the catalogue."""
    return tuple(entry for metrics in installed_metrics().values() for entry in metrics)


def unrepeatable_names() -> list[str]:
    """Returns the names of metrics that depend on the machine; equal trials agree in all others."""
    return [entry.name for entry in all_metrics() if not entry.is_repeatable]


def measure_all(log: TrialLog, known: Mapping[str, float] | None = None) -> dict[str, Measurement]:
    """Returns every installed metric of a trial by name, with the reasons of undefined ones.

    known: values that were measured already.
    """
    known = known or {}
    return {entry.name: entry.measure(log, known.get(entry.name)) for entry in all_metrics()}
