"""identification.md of settings and cells: what was found, what is proposed, every number."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from drake_navbench.analysis.identification_text import PERCENT, Result, of_seeds, percent, table


def settings_lines(result: Result) -> Iterator[str]:
    """Yields what is known of every value that was searched."""
    runs = result["runs"]
    values = result["agreement"]["values"]
    several = len(runs) > 1
    by_any = " by any seed" if several else ""
    apart_means = " *Apart*: the seeds' values, as a share of the range." if several else ""
    yield "## Settings found"
    yield ""
    yield (
        "*As good*: where the emulated error of the cells that tell of the block, minimised over "
        "its other values, is no more than two left-out residuals above its least. "
        f"*Told* is a value where all that is as good{by_any} lies within half of the searched "
        f"range.{apart_means} *Without a part*: what the searches found with a scenario "
        "or a controller held out."
    )
    yield ""
    rows: list[tuple[str, ...]] = []
    for number, block in enumerate(runs[0]["blocks"]):
        for place, value in enumerate(block["values"]):
            here = [run["blocks"][number]["values"][place] for run in runs]
            agreed = values[len(rows)]
            rows.append(
                (
                    block["title"],
                    f"`{value['name']}`",
                    _value(value["shipped"]),
                    of_seeds([_value(entry["found"]) for entry in here]),
                    *([percent(agreed["apart"])] if several else []),
                    of_seeds([_as_good(entry) for entry in here]),
                    _searched(value),
                    of_seeds([_in_folds(entry) for entry in here]),
                    "yes" if agreed["is_told"] else "no",
                )
            )
    apart = ["apart"] if several else []
    yield from table(
        (
            "block",
            "value",
            "shipped",
            "found",
            *apart,
            "as good",
            "searched",
            "without a part",
            "told",
        ),
        rows,
    )
    yield from _told(values, len(runs))


def _told(values: Sequence[Result], seeds: int) -> Iterator[str]:
    """Yields which values are told and which not, and of these what speaks against it."""
    untold = [value for value in values if not value["is_told"]]
    if not untold:
        yield "All of them are told."
        yield ""
        return
    yield f"What the tables, with these searches, do not tell: {_named(untold)}."
    yield ""
    if seeds == 1:
        return
    parts = (
        ("Told, with every seed alike", [value for value in values if value["is_told"]]),
        (
            "Every seed tells them, but not the same",
            [value for value in untold if value["is_told_by"] == seeds],
        ),
        ("Told by some seeds only", [v for v in untold if 0 < v["is_told_by"] < seeds]),
    )
    for title, chosen in parts:
        yield f"- {title}: {_named(chosen)}."
    yield ""


def _named(values: Sequence[Result]) -> str:
    return ", ".join(f"`{value['name']}` ({value['block']})" for value in values) or "none"


def presets_lines(result: Result) -> Iterator[str]:
    """Yields how what was found compares with the shipped presets."""
    yield "## Shipped presets against identified ones"
    yield ""
    by_run = [run["presets"] for run in result["runs"]]
    if not by_run[0]:
        yield "Without a scenario and a controller to hold out there is nothing to compare them by."
        yield ""
        return
    with_every = " with every seed; its values are those of the first" if len(by_run) > 1 else ""
    yield (
        "On the cells of *both held out*; the shipped presets were fitted by hand to these very "
        "cells, which is to their advantage. Proposed is what is shown to be better"
        f"{with_every}: the 95% interval of the difference of the errors, over the cells, is "
        "below 0."
    )
    yield ""
    yield from table(
        (
            "preset",
            "mean error: shipped, identified",
            "difference",
            "median: shipped, identified",
            "proposed",
        ),
        [
            (
                f"`{rows[0]['preset']}`",
                of_seeds([_pair(row, "mean_error") for row in rows]),
                of_seeds(
                    [" to ".join(f"{PERCENT * b:+.1f}%" for b in row["difference"]) for row in rows]
                ),
                of_seeds([_pair(row, "median_error") for row in rows]),
                "; ".join(f"`{name}` {_value(value)}" for name, value in rows[0]["values"].items())
                if rows[0]["controller"] in result["proposed"]
                else "no: stays as it is",
            )
            for rows in zip(*by_run, strict=True)
        ],
    )


def _pair(row: Result, name: str) -> str:
    return f"{percent(row['shipped'][name])}, {percent(row['identified'][name])}"


def cells_lines(result: Result, kinds: Mapping[str, str]) -> Iterator[str]:
    """Yields every cell of the first seed; kinds: titles of what was held out, by name."""
    runs = result["runs"]
    yield "## Every cell"
    yield ""
    seed = f" Ours are those of seed {runs[0]['seed']}." if len(runs) > 1 else ""
    yield f"Published number; ours, with its relative error, by what was held out.{seed}"
    yield ""
    rows = []
    for row in runs[0]["table"]:
        place = f"{row['scenario']}, {row['metric']}, {row['controller']}"
        numbers = [_number(row["ours"].get(kind), row["target"]) for kind in kinds]
        rows.append((place, f"{row['target']:g}", *numbers))
    yield from table(("cell", "published", *kinds.values()), rows)


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
