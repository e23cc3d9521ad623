"""Finds the installed metrics, the built-in ones and a user's alike, by entry point."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import entry_points
from types import ModuleType

from drake_navbench.analysis.metrics.definition import Measurement, Metric
from drake_navbench.errors import InputError
from drake_navbench.log import TrialLog

ENTRY_POINT_GROUP = "drake_navbench.metrics"
# The order of the catalogue and of the columns; a user's themes follow by name.
BUILTIN_THEMES = (
    "published",
    "efficiency",
    "tracking",
    "safety",
    "smoothness",
    "comfort",
    "compute",
)


@lru_cache(maxsize=1)
def installed_metrics() -> Mapping[str, tuple[Metric, ...]]:
    """Returns the metrics by theme (the entry point's name).

    Raises InputError where an entry point names no metric, or two metrics share a name.
    """
    found = {point.name: point for point in entry_points(group=ENTRY_POINT_GROUP)}
    themes = [theme for theme in BUILTIN_THEMES if theme in found]
    themes += sorted(set(found) - set(themes))
    by_theme = {theme: metrics_in(found[theme].load(), theme) for theme in themes}
    owner: dict[str, str] = {}
    for theme, metrics in by_theme.items():
        for entry in metrics:
            if entry.name in owner:
                raise InputError(
                    f"metric {entry.name!r} is defined by {owner[entry.name]!r} and by {theme!r} "
                    f"(entry points {ENTRY_POINT_GROUP}); expected distinct names"
                )
            owner[entry.name] = theme
    return by_theme


def metrics_in(loaded: ModuleType | Metric, theme: str) -> tuple[Metric, ...]:
    """Returns the metrics that an entry point names: those of a module in order, or the one."""
    if isinstance(loaded, Metric):
        return (loaded,)
    found = vars(loaded).values() if isinstance(loaded, ModuleType) else ()
    # A module may import metrics of another one; only its own count.
    own = tuple(
        value
        for value in found
        if isinstance(value, Metric) and value.function.__module__ == loaded.__name__
    )
    if not own:
        raise InputError(
            f"entry point {theme!r} of {ENTRY_POINT_GROUP} names {loaded!r}; "
            "expected a function decorated with @metric, or a module with some"
        )
    return own


def all_metrics() -> tuple[Metric, ...]:
    """Returns every installed metric in the order of the catalogue."""
    return tuple(entry for metrics in installed_metrics().values() for entry in metrics)


def unrepeatable_names() -> list[str]:
    """Returns the metrics that depend on the machine: two equal runs agree in all others."""
    return [entry.name for entry in all_metrics() if not entry.is_repeatable]


def measure_all(log: TrialLog, known: Mapping[str, float] | None = None) -> dict[str, Measurement]:
    """Returns every installed metric of a trial by name, with the reasons of undefined ones.

    known: values that were measured already.
    """
    known = known or {}
    return {entry.name: entry.measure(log, known.get(entry.name)) for entry in all_metrics()}
