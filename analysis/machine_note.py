"""The sentences of a report about the machine on which compute times were measured."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def compute_note(manifest: Mapping[str, Any]) -> str:
    """Returns processor, workers and load from a manifest in words; '' if it names no machine."""
    machines = [entry for entry in manifest.get("machines", []) if isinstance(entry, Mapping)]
    if not machines:
        return ""
    told = "; then ".join(dict.fromkeys(map(_machine, machines)))
    if cluster := _cluster(manifest):
        told = f"{cluster}; trials that no cluster drove on {told}"
    text = f"Compute times were measured on {told}."
    if any(_is_shared(machine) for machine in machines):
        text += (
            " Trials shared the machine, with one another or with other programs, which makes "
            "wall-clock times longer. Processor times leave out waiting; --jobs 1 on a quiet "
            "machine measures best."
        )
    return text


def _cluster(manifest: Mapping[str, Any]) -> str:
    """Returns a cluster's processors with the number of trials that each kind drove."""
    driven: dict[str, int] = {}
    for entry in manifest.get("cluster", []):
        name = str(entry.get("processor", "an unknown processor"))
        driven[name] = driven.get(name, 0) + int(entry.get("trials", 0))
    return ", ".join(f"a cluster of {name} ({count} trials)" for name, count in driven.items())


def _machine(entry: Mapping[str, Any]) -> str:
    jobs, cores = entry.get("jobs", 1), entry.get("cores", 1)
    text = f"{entry.get('processor', 'an unknown processor')}, {cores} core{'s' * (cores != 1)}, "
    text += f"{jobs} trial{'s' * (jobs != 1)} at a time"
    load = entry.get("load_before")
    return text if load is None else f"{text}, load {load:g} before the run"


def _is_shared(entry: Mapping[str, Any]) -> bool:
    """Whether another process may have run on the same processor, with its caches and clock."""
    return entry.get("jobs", 1) > 1 or (entry.get("load_before") or 0.0) >= 0.5
