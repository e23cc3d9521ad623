"""The page of a parity: Markdown."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from statistics import median

from drake_navbench.logs.text_tables import markdown_table
from drake_navbench.native.builds import Build, NoiseSource
from drake_navbench.studies.side_by_side.likeness import Likeness
from drake_navbench.studies.side_by_side.parity import DecisionResult, Parity, TrialResult
from drake_navbench.studies.side_by_side.planner_parity import PlannerParity, PlanResult

TITLE = "# Ports and originals:"
SHOWN = 5
# Known reasons why a port does not drive like its original to the last bit.
REASONS: Mapping[str, str] = {
    "rpp": "The original turns headings into quaternions and back, the port does not: that rounds "
    "otherwise in the last bits.",
    "teb_upstream": "The original reads the robot's corners in single precision, which can decide "
    "which edge is the nearest to an obstacle: the port does so with footprint_model.type=polygon. "
    "It draws its roadmap from a generator of its own: enable_homotopy_class_planning=false needs "
    "none. It takes slopes by central differences, the port exactly.",
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


def to_markdown(
    build: Build, parities: Sequence[Parity], planners: Sequence[PlannerParity] = ()
) -> str:
    """Returns the page of a build."""
    lines = [
        f"{TITLE} `{build.name}`",
        "",
        f"Nav2 {build.where_from}, compiled by {build.compiler}. Each cell counts what is "
        f"{', '.join(Likeness)}.",
    ]
    if parities:
        lines += ["", *_controllers(parities)]
    if planners:
        lines += ["", *_planners(planners)]
    for parity in parities:
        lines += ["", f"## {parity.preset}", "", *_details(parity, build)]
    for planner in planners:
        lines += ["", f"## {_with_values(planner)}", "", *_of_planner(planner)]
    return "\n".join([*lines, ""])


def _controllers(parities: Sequence[Parity]) -> list[str]:
    lines = [
        "Both of each pair were given the parameters of the preset; a port that knows releases "
        "drives by the rules of this one, another by those of Lyrical. Up to Kilted an original "
        "cuts the plan itself. A scene is one decision from rest. A cycle is one of a trial that "
        "the port drives, in which the original sees the same. A trial is driven by each, and "
        "counts by its commands in all cycles and by how it ends.",
        "",
    ]
    rows = []
    for parity in parities:
        cycles = [cycle for trial in parity.trials for cycle in trial.cycles]
        cells = [_counts(results) for results in (parity.scenes, cycles, parity.trials)]
        rows.append([f"`{parity.preset}`", f"`{parity.plugin}`", *cells])
    titles = ("controller", "original", "scenes", "cycles", "trials")
    return lines + markdown_table(titles, rows, "llrrr")


def _planners(planners: Sequence[PlannerParity]) -> list[str]:
    lines = [
        "Planners find a way over random maps; what is not given has the original's default. A "
        "port's own switches are as in Nav2.",
        "",
    ]
    rows = []
    for planner in planners:
        plans = sum(result.has_plan for result in planner.results)
        rows.append((_with_values(planner), str(plans), _counts(planner.results)))
    return lines + markdown_table(("planner", "plans of both", "maps"), rows, "lrr")


def _with_values(planner: PlannerParity) -> str:
    values = ", ".join(f"{name}: {value}" for name, value in planner.values.items())
    return f"`{planner.plugin}`" + (f" with {values}" if values else "")


def _of_planner(planner: PlannerParity) -> list[str]:
    known = [r.difference for r in planner.results if math.isfinite(r.difference)]
    lines = [f"The largest difference of a pose is {max(known, default=0.0):.2g} (m, rad)."]
    different = [result.told for result in planner.results if result.told]
    return lines + [""] * bool(different) + [f"- {told}" for told in different[:SHOWN]]


def _counts(results: Sequence[DecisionResult | TrialResult | PlanResult]) -> str:
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
    reason = REASONS.get(parity.preset.partition(":")[0])
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
        rows = [(f"`{o.name}`", str(o.of_port), str(o.of_original)) for o in parity.defaults]
        lines += markdown_table(("parameter", "port", "original"), rows)
    if parity.not_read:
        names = ", ".join(f"`{name}`" for name in parity.not_read)
        lines += ["", f"Given, and not read by the original: {names}."]
    return lines


def _trials(trials: Sequence[TrialResult]) -> list[str]:
    rows = []
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
        rows.append(cells)
    titles = ("scenario", "seed", "commands", "largest difference", "apart from")
    return markdown_table((*titles, "port", "original"), rows, "lrlrr")
