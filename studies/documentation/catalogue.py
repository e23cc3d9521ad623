"""The catalogue of metrics, docs/metrics.md, from the metrics' own docstrings."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable

from drake_navbench.analysis.invariants import INVARIANTS
from drake_navbench.analysis.metrics.definition import Metric
from drake_navbench.analysis.metrics.registry import installed_metrics
from drake_navbench.logs.text_tables import markdown_table

INTRODUCTION = """\
# Metrics

The meaning of each column of a table or report, a number computed from the log of one trial. These
commands choose the columns of the terminal, and add [a metric of your own](two_files.md#metrics):

```
drake-navbench run empty --controllers rpp --columns time_to_goal_s,min_clearance_m
drake-navbench run empty --controllers rpp --metric my.py:my_metric
```

- ↑: higher is better; ↓: lower is better; no arrow: neither. The unit stands in brackets.
- Bar: verdicts ignore differences up to this one.
- An empty cell: the trial has no value of the metric; the cell names the reason.
- Derivatives of the true motion end with the trial: the stop after it does not count.
- *First plan*: the plan made at the start; with waypoints those of all legs, one behind the other
  (`course` of a `TrialLog`). *Plan in force*: the latest one that the controller had been given;
  tracking begins with the first.
- Metrics of worlds in which something moves: [moving](living_world.md#moving),
  [social](living_world.md#social).
- Sources by name: BARN (Perille et al. 2020; Xiao et al. 2022), HuNavSim (Perez-Higueras et al.
  2023), SEAN 2.0 (Tsoi et al. 2022), SocNavBench (Biswas et al. 2022), TAGA (Roy and Rahman, arXiv
  2503.21168v3).

A package offers metrics by an entry point in `drake_navbench.metrics` that names their module.
`make docs` makes this page from the metrics' docstrings.
"""
# Sentences below the headings of some themes.
NOTES = {
    "published": "Defined as in Schena 2024, weaknesses included. v and w are commands; samples are"
    " 0.115 s apart.",
    "compute": "Compute times differ from run to run.",
}
CHECKS = """\
## Checks

Every log must keep these rules, whatever the controller does. The report warns of each broken one;
the column `violations` in trials.parquet counts the rows that break one."""
ARROWS = {"higher": " ↑", "lower": " ↓", "neither": ""}
# Themes whose tables stand in living_world.md.
OF_A_LIVING_WORLD = ("moving", "social")
REPLACED_BY = {
    "abort_time": "stall_time_s",
    "avg_heading_error": "heading_error_mean_deg",
    "avg_path_error": "cross_track_error_mean_m",
    "energy": "mechanical_energy_j",
    "max_centripetal_acceleration": "lateral_acceleration_max_mps2",
    "max_path_error": "cross_track_error_max_m",
    "min_obstacle_distance": "min_clearance_m",
    "path_length": "driven_length_m",
    "rms_linear_jerk": "jerk_rms_mps3",
    "time_taken": "time_to_goal_s",
}


def catalogue() -> str:
    """Returns the catalogue of the installed metrics as Markdown."""
    parts = [INTRODUCTION]
    for theme in installed_metrics():
        if theme not in OF_A_LIVING_WORLD:
            parts += ["", *_theme(theme, "##")]
    return "\n".join(parts) + "\n"


def checks() -> list[str]:
    """Returns the lines of the section about the rules that every log keeps."""
    rows = ((kind, _first_line(check)) for kind, check in INVARIANTS.items())
    return [*CHECKS.splitlines(), "", *markdown_table(("check", "what"), rows)]


def living_metrics() -> str:
    """Returns the tables of the metrics of worlds in which something moves."""
    moving, social = (_theme(theme, "###") for theme in OF_A_LIVING_WORLD)
    return "\n".join([*moving, "", *social])


def _theme(theme: str, level: str) -> list[str]:
    """Returns the heading and the table of a theme."""
    rows = [_row(entry) for entry in installed_metrics()[theme]]
    table = markdown_table(("metric", "what", "formula"), rows)
    note = [NOTES[theme], ""] if theme in NOTES else []
    return [f"{level} {theme.capitalize()}", "", *note, *table]


def section(entry: Metric, title: str) -> str:
    """Returns the paragraph of a metric's docstring that starts with `title:`, on one line."""
    found = re.search(rf"^{title}: (.*?)(?=^Source: |\Z)", entry.description, re.M | re.S)
    return " ".join(found.group(1).split()) if found else ""


def _first_line(check: Callable[..., object]) -> str:
    return (inspect.getdoc(check) or "").partition("\n")[0].removeprefix("Flags ")


def _row(entry: Metric) -> list[str]:
    what = entry.summary
    if entry.name in REPLACED_BY:
        what += f" Prefer `{REPLACED_BY[entry.name]}`."
    if entry.relevant:
        what += f" Bar: {entry.relevant:g} {entry.unit}."
    formula, source = section(entry, "Formula"), section(entry, "Source")
    if source:
        formula += f" Source: {source}"
    unit = f" [{entry.unit}]" if entry.unit else ""
    return [f"`{entry.name}`{unit}{ARROWS[entry.better]}", what, formula]
