"""The page of a parity: Markdown."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

from drake_navbench.native.builds import Build
from drake_navbench.side_by_side.parity import Likeness, Parity, SceneResult, TrialResult

SHOWN = 5
# What is known of why a port does not drive as the original to the last bit.
REASONS: Mapping[str, str] = {
    "rpp": "The original turns headings into quaternions and back, the port does not: that rounds "
    "otherwise in the last bits.",
    "mppi_nav2": "The original draws its noises from a generator of its own, with the seed that "
    "its library starts with and the same in each trial; the port's are a function of trial and "
    "cycle.",
}


def to_markdown(build: Build, parities: Sequence[Parity]) -> str:
    """Returns the page of a build."""
    lines = [
        f"# Ports and originals: `{build.name}`",
        "",
        f"Nav2 {build.where_from}, compiled by {build.compiler}. Both of each pair were given the "
        "parameters of the preset. A scene is one decision from rest; a trial counts by its "
        "commands in all cycles, and by how it ends.",
        "",
        "| controller | original | " + " | ".join(_titles("scenes") + _titles("trials")) + " |",
        "|---|---|" + "---:|" * 6,
    ]
    for parity in parities:
        cells = [*_counts(parity.scenes), *_counts(parity.trials)]
        lines.append(f"| `{parity.preset}` | `{parity.plugin}` | {' | '.join(cells)} |")
    for parity in parities:
        lines += ["", f"## {parity.preset}", "", *_details(parity)]
    return "\n".join([*lines, ""])


def _titles(what: str) -> list[str]:
    return [f"{what} {likeness}" for likeness in Likeness]


def _counts(results: Sequence[SceneResult | TrialResult]) -> list[str]:
    counts = Counter(result.likeness for result in results)
    return [str(counts[likeness]) for likeness in Likeness]


def _details(parity: Parity) -> list[str]:
    known = [r.difference for r in parity.scenes if math.isfinite(r.difference)]
    failed = sum(not math.isfinite(result.difference) for result in parity.scenes)
    lines = [
        f"Scenes: the largest difference of a command is {max(known, default=0.0):.2g} (m/s, "
        f"rad/s); in {failed} of {len(parity.scenes)} at least one finds no command.",
    ]
    if parity.preset in REASONS:
        lines += ["", REASONS[parity.preset]]
    different = [result.told for result in parity.scenes if result.told]
    lines += [""] * bool(different) + [f"- {told}" for told in different[:SHOWN]]
    if parity.trials:
        lines += ["", *_trials(parity.trials)]
    if parity.defaults:
        lines += ["", "Defaults that differ, where nothing is given:", ""]
        lines += ["| parameter | port | original |", "|---|---|---|"]
        lines += [f"| `{o.name}` | {o.of_port} | {o.of_original} |" for o in parity.defaults]
    if parity.not_read:
        names = ", ".join(f"`{name}`" for name in parity.not_read)
        lines += ["", f"Given, and not read by the original: {names}."]
    return lines


def _trials(trials: Sequence[TrialResult]) -> list[str]:
    lines = [
        "| scenario | seed | commands | largest difference | apart from | port | original |",
        "|---|---:|---|---:|---:|---|---|",
    ]
    for t in trials:
        apart = f"{t.apart_s:.2f} s" if math.isfinite(t.apart_s) else "never"
        cells = [
            t.scenario,
            str(t.seed),
            str(t.likeness),
            f"{t.difference:.2g}",
            apart,
            *t.outcomes,
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return lines
