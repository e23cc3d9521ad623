"""identification.md: what tables told of settings, and what these predicted of held-out cells."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from drake_navbench.analysis.identification_text import (
    SEEDS_APART,
    Result,
    of_seeds,
    percent,
    table,
)
from drake_navbench.analysis.identification_values import (
    cells_lines,
    presets_lines,
    settings_lines,
)
from drake_navbench.results import write_text

RESULT_NAME = "identification.json"
PAGE_NAME = "identification.md"
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


def write_identification_page(folder: Path) -> Path:
    """Writes the page of a folder from its identification.json; returns its path."""
    result = json.loads((folder / RESULT_NAME).read_text(encoding="utf-8"))
    path = folder / PAGE_NAME
    write_text(path, "\n".join(page_lines(result)) + "\n")
    return path


def page_lines(result: Result) -> Iterator[str]:
    """Yields the lines of the page."""
    runs = result["runs"]
    kinds = [kind for kind in KINDS if kind in runs[0]["scores"]]
    yield "# What the published tables tell of layout and settings"
    yield ""
    yield from _made_by(result)
    yield from _verdict(runs)
    yield from _how(result)
    yield "## Fitted and predicted"
    yield ""
    yield from table(
        ("found without", "numbers", "median relative error", "orderings", "same order"),
        [(KINDS[kind], *_score_cells([_together(run, kind) for run in runs])) for kind in kinds],
    )
    yield from _by_part(runs, kinds, "scenarios", "scenario")
    yield from _by_part(runs, kinds, "controllers", "controller")
    if len(runs) > 1:
        yield from _between_seeds(result, kinds)
    yield from settings_lines(result)
    yield from presets_lines(result)
    yield from cells_lines(result, {kind: KINDS[kind] for kind in kinds})


def _made_by(result: Result) -> Iterator[str]:
    runs = result["runs"]
    driven = of_seeds([str(run["driven_settings"]) for run in runs])
    yield (
        f"Made by `{result['command']}` (version {result['drake_navbench']}): "
        f"{driven} settings driven for a fit, {result['fitted_cells']} of {result['cells']} cells "
        f"fitted to, {result['trials']} trials a prediction."
    )
    yield ""
    if len(runs) > 1:
        yield (
            f"All was done once with each of the seeds {_named_seeds(runs)}, and none knew of the "
            f"others. What they come to stands side by side in this order, with "
            f"{SEEDS_APART.strip()} between; where it is the same for all, once."
        )
        yield ""


def _verdict(runs: Sequence[Result]) -> Iterator[str]:
    yield "## Verdict"
    yield ""
    judged = [kind for kind in STRICTEST if kind in runs[0]["scores"]]
    if not judged:
        yield "Nothing was held out: what agrees here is fitted, and confirms nothing."
        yield ""
        return
    kind = judged[0]
    yield f"Judged on cells that nothing was fitted to ({KINDS[kind]}):"
    yield ""
    goals = [_goals(run, kind) for run in runs]
    rows = [
        (here[0].goal, *(goal.found for goal in here), _is_met([goal.is_met for goal in here]))
        for here in zip(*goals, strict=True)
    ]
    names = [f"found, seed {run['seed']}" for run in runs] if len(runs) > 1 else ["found"]
    yield from table(("goal", *names, ""), rows)


class _Goal(NamedTuple):
    """What was aimed at, what was found, and whether that is it; None where it has no value."""

    goal: str
    found: str
    is_met: bool | None


def _goals(run: Result, kind: str) -> list[_Goal]:
    scores = run["scores"][kind]
    together = scores["together"]
    highest = run["ceilings"].get("together", {}).get("concordance")
    least = min(GOAL_CONCORDANCE, 1.0 if highest is None else highest)
    known = [
        (score["concordance"], name)
        for name, score in scores["scenarios"].items()
        if score["concordance"] is not None
    ]
    worst, where = min(known, default=(None, ""))
    concordance, error = together["concordance"], together["median_error"]
    return [
        _Goal(
            f"{percent(GOAL_CONCORDANCE)} of the orderings, or the ceiling",
            f"{percent(concordance)} (ceiling {percent(highest)})",
            None if concordance is None else concordance >= least,
        ),
        _Goal(
            f"no scenario below {percent(GOAL_IN_SCENARIO)}",
            f"{percent(worst)} ({where})" if where else percent(None),
            None if worst is None else worst >= GOAL_IN_SCENARIO,
        ),
        _Goal(
            f"median relative error below {percent(GOAL_ERROR)}",
            percent(error),
            None if error is None else error < GOAL_ERROR,
        ),
    ]


def _is_met(found: Sequence[bool | None]) -> str:
    if any(entry is None for entry in found):
        return "–"
    return "met" if all(found) else "not met by all" if any(found) else "not met"


def _how(result: Result) -> Iterator[str]:
    blind = ", ".join(f"`{preset}`" for preset in result["blind"].values())
    yield "## How"
    yield ""
    yield (
        "What a controller does in a scenario is a function of what all have in common (base), "
        "the scenario's layout and its own settings. Driven are first settings all over the "
        "ranges, the same for every fit (Sobol's points, which know no table). From these an "
        "emulator of every cell learns how far the cell is off its number (a Gaussian process). "
        f"Then each fit has {result['rounds']} settings of its own driven, one after the other: "
        "where the emulators expect the least mean error of the cells that are not held out; they "
        "learn from each. Found is what was driven with the least. An error is relative, and none "
        "counts more than 100%. No search begins at what is shipped."
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


def _by_part(runs: Sequence[Result], kinds: Sequence[str], part: str, title: str) -> Iterator[str]:
    yield f"### By {title}: median relative error, same order"
    yield ""
    names = list(dict.fromkeys(n for kind in kinds for n in runs[0]["scores"][kind][part]))
    with_ceiling = part == "scenarios"
    header = [title, *(KINDS[kind] for kind in kinds), *(["ceiling"] if with_ceiling else [])]

    rows = []
    for name in (*names, *(["together"] if with_ceiling else [])):
        cells = []
        for kind in kinds:
            scores = [run["scores"][kind] for run in runs]
            own = [s["together"] if name == "together" else s[part].get(name) for s in scores]
            cells.append(of_seeds([_short(score) for score in own]))
        if with_ceiling:
            cells.append(of_seeds([_ceiling(run["ceilings"].get(name)) for run in runs]))
        rows.append((name if name == "together" else f"`{name}`", *cells))
    yield from table(header, rows)


def _between_seeds(result: Result, kinds: Sequence[str]) -> Iterator[str]:
    yield "## What the seeds agree on"
    yield ""
    yield (
        "Of the orderings, how many come out with every seed, with some and with none; and how far "
        "apart two seeds' numbers for a cell are, relative to the published one. Those that "
        "come out with some hang on chance."
    )
    yield ""
    found = result["agreement"]["predictions"]
    yield from table(
        ("found without", "every seed", "some", "none", "apart, median"),
        [
            (
                KINDS[kind],
                *(str(found[kind][name]) for name in ("all", "some", "none")),
                percent(found[kind]["apart"]),
            )
            for kind in kinds
        ],
    )


def _together(run: Result, kind: str) -> Result:
    together: Result = run["scores"][kind]["together"]
    return together


def _named_seeds(runs: Sequence[Result]) -> str:
    *most, last = [str(run["seed"]) for run in runs]
    return f"{', '.join(most)} and {last}"


def _score_cells(scores: Sequence[Result]) -> tuple[str, ...]:
    return (
        of_seeds([str(score["cells"]) for score in scores]),
        of_seeds([percent(score["median_error"]) for score in scores]),
        of_seeds([str(score["orderings"]) for score in scores]),
        of_seeds([percent(score["concordance"]) for score in scores]),
    )


def _short(score: Result | None) -> str:
    if score is None:
        return "–"
    return f"{percent(score['median_error'])}, {percent(score['concordance'])}"


def _ceiling(score: Result | None) -> str:
    if score is None or score["concordance"] is None:
        return "–"
    return f"{percent(score['concordance'])} of {score['orderings']}"
