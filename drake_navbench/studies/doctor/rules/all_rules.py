"""All rules of the doctor: those of the controllers first, then those of the other servers."""

from __future__ import annotations

from drake_navbench.studies.doctor.rules import (
    bands,
    checkers,
    costmap_pairs,
    costmaps,
    dwb,
    dwb_arrival,
    inflation,
    monitor,
    mppi,
    mppi_critics,
    outline,
    planners,
    pursuit,
    releases,
    rpp_turns,
    servers,
    shim,
    smoother,
    sources,
    startup,
)
from drake_navbench.studies.doctor.rules.rule import Rule

MODULES = (mppi, mppi_critics, dwb, dwb_arrival, pursuit, rpp_turns, shim, bands)
MODULES_OF_SERVERS = (
    startup, sources, servers, smoother, checkers, monitor, outline, costmaps, inflation,
    costmap_pairs, planners, releases,
)  # fmt: skip
RULES: tuple[Rule, ...] = tuple(
    rule for module in (*MODULES, *MODULES_OF_SERVERS) for rule in module.RULES
)
