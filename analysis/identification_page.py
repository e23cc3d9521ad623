"""identification.md: what tables told of settings, and what these predicted of held-out cells."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from drake_navbench.results import write_text

RESULT_NAME = "identification.json"
PAGE_NAME = "identification.md"
PERCENT = 100.0
# The goals: of the orderings, in every scenario too, and of the relative error.
GOAL_CONCORDANCE, GOAL_IN_SCENARIO, GOAL_ERROR = 0.9, 0.8, 0.1

KINDS = {
    "shipped": "shipped, fitted by hand to all cells",
    "fitted": "fitted",
    "left_out": "left out of every fit",
    "scenario": "one scenario held out",
    "controller": "one controller held out, its own settings as shipped",
    "controller_blind": "one controller held out, its own settings blind",
    "both": "scenario and controller held out",
}
# In the order of what they are worth: whose goals are judged.
STRICTEST = ("both", "scenario", "controller_blind", "left_out")
Result = Mapping[str, Any]


def write_identification_page(folder: Path) -> Path:
    """Writes the page of a folder from its identification.json; returns its path."""
    result = json.loads((folder / RESULT_NAME).read_text(encoding="utf-8"))
    path = folder / PAGE_NAME
    write_text(path, "\n".join(page_lines(result)) + "\n")
    return path


def page_lines(result: Result) -> Iterator[str]:
    """Yields the lines of the page."""
    kinds = [kind for kind in KINDS if kind in result["scores"]]
    yield "# What the published tables tell of layout and settings"
    yield ""
    yield (
        f"Made by `{result['command']}` (version {result['drake_navbench']}): "
        f"{result['evaluations']} evaluations, {result['fitted_cells']} of {result['cells']} cells "
        f"fitted to, {result['trials']} trials a prediction."
    )
    yield ""
    yield from _verdict(result)
    yield from _how(result)
    yield "## Fitted and predicted"
    yield ""
    yield from _table(
        ("found without", "numbers", "median relative error", "orderings", "same order"),
        [(KINDS[kind], *_score_cells(result["scores"][kind]["together"])) for kind in kinds],
    )
    yield from _by_part(result, kinds, "scenarios", "scenario")
    yield from _by_part(result, kinds, "controllers", "controller")
    yield from _settings(result)
    yield from _proposals(result)
    yield from _cells(result, kinds)


def _verdict(result: Result) -> Iterator[str]:
    yield "## Verdict"
    yield ""
    judged = [kind for kind in STRICTEST if kind in result["scores"]]
    if not judged:
        yield "Nothing was held out: what agrees here is fitted, and confirms nothing."
        yield ""
        return
    kind = judged[0]
    scores = result["scores"][kind]
    together = scores["together"]
    highest = result["ceilings"].get("together", {}).get("concordance")
    goal = min(GOAL_CONCORDANCE, 1.0 if highest is None else highest)
    worst = min(
        (
            (score["concordance"], name)
            for name, score in scores["scenarios"].items()
            if score["concordance"] is not None
        ),
        default=(None, ""),
    )
    rows = [
        (
            f"{_percent(goal)} of the orderings, or the ceiling",
            _percent(together["concordance"]),
            _is_met(together["concordance"], goal),
        ),
        (
            f"no scenario below {_percent(GOAL_IN_SCENARIO)}",
            f"{_percent(worst[0])} ({worst[1]})" if worst[1] else "–",
            _is_met(worst[0], GOAL_IN_SCENARIO),
        ),
        (
            f"median relative error below {_percent(GOAL_ERROR)}",
            _percent(together["median_error"]),
            _is_met(GOAL_ERROR, together["median_error"]),
        ),
    ]
    yield f"Judged on cells that nothing was fitted to ({KINDS[kind]}):"
    yield ""
    yield from _table(("goal", "found", ""), rows)


def _how(result: Result) -> Iterator[str]:
    blind = ", ".join(f"`{preset}`" for preset in result["blind"].values())
    yield "## How"
    yield ""
    sobol_points, rounds = result["sobol_points"], result["rounds"]
    yield (
        "Each block of unknowns is a search of its own: the layout of every scenario by that "
        "scenario's cells, what all have in common (base) by all cells, each controller's own "
        f"settings by its column. The first {sobol_points} points are Sobol's, the others TPE's; "
        "none begins at what is shipped. Searched is the mean of the cells' relative errors, of "
        "which none counts more than 100%. What a search does not vary is what the searches before "
        "it found; layouts come first, and in the first round see base and controllers as they are "
        f"shipped. Rounds: {rounds}."
    )
    yield ""
    yield (
        "*One scenario held out*: base and own settings without its cells; its layout is the "
        "shipped one. *One controller held out*: layouts and base without its column; blind, its "
        f"own settings are those of {blind}, which nobody fitted to it. *Both held out*: a "
        "controller's own settings and the base from the other scenarios, the layout from the "
        "other controllers; no cell of the controller in the scenario counted for any search. "
        "The ranges, and parameters that are not searched, were chosen by people who knew all "
        "tables; no hold-out undoes that. Predictions have other seeds than searches."
    )
    yield ""
    yield (
        "*Ceiling*: the same count between two runs of the fitted settings, each of as many trials "
        "as a prediction, one of them rounded as the tables are; pairs in which nothing is random "
        "do not count. Published numbers that differ by their last digit, or by less than 1%, "
        "imply no order."
    )
    yield ""


def _by_part(result: Result, kinds: Sequence[str], part: str, title: str) -> Iterator[str]:
    yield f"### By {title}: median relative error, same order"
    yield ""
    names = list(dict.fromkeys(n for kind in kinds for n in result["scores"][kind][part]))
    with_ceiling = part == "scenarios"
    header = [title, *(KINDS[kind] for kind in kinds), *(["ceiling"] if with_ceiling else [])]
    rows = []
    for name in names:
        cells = [
            _short(found) if (found := result["scores"][kind][part].get(name)) else "–"
            for kind in kinds
        ]
        ceiling = [_ceiling(result["ceilings"].get(name))] if with_ceiling else []
        rows.append((f"`{name}`", *cells, *ceiling))
    if with_ceiling:
        own = [_short(result["scores"][kind]["together"]) for kind in kinds]
        rows.append(("together", *own, _ceiling(result["ceilings"].get("together"))))
    yield from _table(header, rows)


def _settings(result: Result) -> Iterator[str]:
    yield "## Settings found"
    yield ""
    yield (
        "*As good*: where a surrogate of the search's error (a Gaussian process), minimised over "
        "all other values of the block, is no more than two left-out residuals above its least. "
        "*Told* is a value of which at most half of the searched range is as good. *Without a "
        "part*: what the searches found with a scenario or a controller held out."
    )
    yield ""
    rows, untold = [], []
    for block in result["blocks"]:
        for value in block["values"]:
            rows.append(
                (
                    block["title"],
                    f"`{value['name']}`",
                    _value(value["shipped"]),
                    _value(value["found"]),
                    _as_good(value),
                    _searched(value),
                    _in_folds(value),
                    "yes" if value["is_told"] else "no",
                )
            )
            if not value["is_told"]:
                untold.append(f"`{value['name']}` ({block['title']})")
    yield from _table(
        ("block", "value", "shipped", "found", "as good", "searched", "without a part", "told"),
        rows,
    )
    if untold:
        yield f"What the tables, with these searches, do not tell: {', '.join(untold)}."
    else:
        yield "All of them are told."
    yield ""


def _proposals(result: Result) -> Iterator[str]:
    yield "## Shipped presets against identified ones"
    yield ""
    rows = result["proposed"]
    if not rows:
        yield "Without a scenario and a controller to hold out there is nothing to compare them by."
        yield ""
        return
    yield (
        "On the cells of *both held out*; the shipped presets were fitted by hand to these very "
        "cells, which is to their advantage. Proposed is what is shown to be better: the 95% "
        "interval of the difference of the errors, over the cells, is below 0."
    )
    yield ""
    yield from _table(
        (
            "preset",
            "mean error: shipped, identified",
            "difference",
            "median: shipped, identified",
            "proposed",
        ),
        [
            (
                f"`{row['preset']}`",
                f"{_percent(row['shipped']['mean_error'])}, "
                f"{_percent(row['identified']['mean_error'])}",
                " to ".join(f"{PERCENT * bound:+.1f}%" for bound in row["difference"]),
                f"{_percent(row['shipped']['median_error'])}, "
                f"{_percent(row['identified']['median_error'])}",
                "; ".join(f"`{name}` {_value(value)}" for name, value in row["values"].items())
                if row["is_better"]
                else "no: stays as it is",
            )
            for row in rows
        ],
    )


def _cells(result: Result, kinds: Sequence[str]) -> Iterator[str]:
    yield "## Every cell"
    yield ""
    yield "Published number; ours, with its relative error, by what was held out."
    yield ""
    rows = []
    for row in result["table"]:
        place = f"{row['scenario']}, {row['metric']}, {row['controller']}"
        numbers = [_number(row["ours"].get(kind), row["target"]) for kind in kinds]
        rows.append((place, f"{row['target']:g}", *numbers))
    yield from _table(("cell", "published", *(KINDS[kind] for kind in kinds)), rows)


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(header)} |"
    yield f"|{'---|' * len(header)}"
    for row in rows:
        yield f"| {' | '.join(row)} |"
    yield ""


def _score_cells(score: Result) -> tuple[str, ...]:
    return (
        str(score["cells"]),
        _percent(score["median_error"]),
        str(score["orderings"]),
        _percent(score["concordance"]),
    )


def _short(score: Result) -> str:
    return f"{_percent(score['median_error'])}, {_percent(score['concordance'])}"


def _ceiling(score: Result | None) -> str:
    if score is None or score["concordance"] is None:
        return "–"
    return f"{_percent(score['concordance'])} of {score['orderings']}"


def _is_met(found: float | None, least: float | None) -> str:
    if found is None or least is None:
        return "–"
    return "met" if found >= least else "not met"


def _percent(share: float | None) -> str:
    if share is None or not math.isfinite(share):
        return "–"
    percent = PERCENT * share
    return f"{percent:.1f}%" if percent < 9.95 else f"{percent:.0f}%"


def _value(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _as_good(value: Result) -> str:
    if value["is_choice"]:
        return ", ".join(map(_value, value["as_good"]))
    return f"{_value(value['low'])} to {_value(value['high'])}"


def _searched(value: Result) -> str:
    if value["is_choice"]:
        return ", ".join(map(_value, value["searched"]))
    return f"{_value(value['searched'][0])} to {_value(value['searched'][1])}"


def _in_folds(value: Result) -> str:
    found = value["in_folds"]
    if not found:
        return "–"
    if value["is_choice"]:
        return ", ".join(f"{_value(v)} ({found.count(v)})" for v in dict.fromkeys(found))
    return f"{_value(min(found))} to {_value(max(found))}"


def _number(ours: float | None, published: float) -> str:
    if ours is None:
        return "–"
    if published == 0.0:
        return f"{ours:.3g}"
    return f"{ours:.3g} ({PERCENT * (ours / published - 1.0):+.0f}%)"
