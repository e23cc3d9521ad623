"""The page of a parity: Markdown."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from statistics import median

from drake_navbench.native.builds import Build, NoiseSource
from drake_navbench.side_by_side.parity import DecisionResult, Likeness, Parity, TrialResult

SHOWN = 5
# What is known of why a port does not drive as the original to the last bit.
REASONS: Mapping[str, str] = {
    "rpp": "The original turns headings into quaternions and back, the port does not: that rounds "
    "otherwise in the last bits.",
}
SAMPLES = "mppi"
OWN_NOISE = (
    "The original draws its noise from a generator of its own, with the seed that its library "
    "starts with, so the two sample otherwise: nav2-build --noise benchmark lets them sample alike."
)
EQUAL_NOISE = (
    "Both sample with equal noise, to the last bit. Sums over samples are taken in another order, "
    "in single precision, and functions such as the exponential are of another library."
)


def to_markdown(build: Build, parities: Sequence[Parity]) -> str:
    """Returns the page of a build."""
    lines = [
        f"# Ports and originals: `{build.name}`",
        "",
        f"Nav2 {build.where_from}, compiled by {build.compiler}. Both of each pair were given the "
        "parameters of the preset; a port that knows releases drives by the rules of this one, "
        "another by those of Lyrical. Up to Kilted an original cuts the plan itself.",
        "",
        "A scene is one decision from rest. A cycle is one of a trial that the port drives, in "
        "which the original sees the same. A trial is driven by each, and counts by its commands "
        f"in all cycles and by how it ends. Each is {', '.join(Likeness)}:",
        "",
        "| controller | original | scenes | cycles | trials |",
        "|---|---|---:|---:|---:|",
    ]
    for parity in parities:
        cycles = [cycle for trial in parity.trials for cycle in trial.cycles]
        cells = [_counts(results) for results in (parity.scenes, cycles, parity.trials)]
        lines.append(f"| `{parity.preset}` | `{parity.plugin}` | {' | '.join(cells)} |")
    for parity in parities:
        lines += ["", f"## {parity.preset}", "", *_details(parity, build)]
    return "\n".join([*lines, ""])


def _counts(results: Sequence[DecisionResult | TrialResult]) -> str:
    counts = Counter(result.likeness for result in results)
    return " / ".join(str(counts[likeness]) for likeness in Likeness)


def _of_decisions(what: str, results: Sequence[DecisionResult]) -> str:
    known = [r.difference for r in results if math.isfinite(r.difference)]
    parts = [f"{what}: the largest difference of a command is {max(known, default=0.0):.2g}"]
    if known:
        parts.append(f"the median {median(known):.2g} (m/s, rad/s)")
    failed = len(results) - len(known)
    return ", ".join(parts) + f"; in {failed} of {len(results)} at least one finds none."


def _details(parity: Parity, build: Build) -> list[str]:
    lines = [_of_decisions("Scenes", parity.scenes)]
    cycles = [cycle for trial in parity.trials for cycle in trial.cycles]
    if cycles:
        lines += ["", _of_decisions("Cycles", cycles)]
    reason = REASONS.get(parity.preset)
    if parity.preset.startswith(SAMPLES):
        reason = OWN_NOISE if build.noise is NoiseSource.OWN else EQUAL_NOISE
    if reason is not None:
        lines += ["", reason]
    different = [result.told for result in (*parity.scenes, *cycles) if result.told]
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
