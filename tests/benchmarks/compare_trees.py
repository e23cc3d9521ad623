"""Benchmarks of two trees on one machine: `make bench-compare BASE=tree HEAD=tree`.

The trees take turns, so that what else the machine does meets both. What counts is the median over
the rounds of a row's median. Status 1: a row of HEAD takes more than LIMIT times that of BASE;
2: the two cannot be compared.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

LIMIT = 1.15
DEFAULT_ROUNDS = 3
SLOWER, INCOMPARABLE = 1, 2
Results = Sequence[Mapping[str, Any]]


class Incomparable(Exception):
    """Two sets of results were not measured alike."""


def medians(results: Results) -> dict[str, float]:
    """Returns the median over the rounds of each row's median, s; raises Incomparable."""
    rounds = [{row["fullname"]: row["stats"]["median"] for row in r["benchmarks"]} for r in results]
    for names in rounds[1:]:
        if names.keys() != rounds[0].keys():
            missing = ", ".join(sorted(names.keys() ^ rounds[0].keys()))
            raise Incomparable(f"not in every round: {missing}")
    return {name: statistics.median(r[name] for r in rounds) for name in rounds[0]}


def ratios(base: Results, head: Results) -> dict[str, float]:
    """Returns how many times as long each row takes in `head`; raises Incomparable.

    base, head: the JSON of pytest-benchmark, one a round.
    """
    processors = {str(r["machine_info"]["cpu"].get("brand_raw")) for r in (*base, *head)}
    if len(processors) != 1:
        raise Incomparable(f"measured on different processors: {', '.join(sorted(processors))}")
    before, after = medians(base), medians(head)
    if not before:
        raise Incomparable("no benchmark was run")
    if missing := sorted(before.keys() ^ after.keys()):
        raise Incomparable(f"in one tree only: {', '.join(missing)}")
    return {name: after[name] / before[name] for name in before}


def table(found: Mapping[str, float]) -> str:
    """Returns a line a row, the slowest first."""
    ordered = sorted(found.items(), key=lambda row: -row[1])
    return "\n".join(
        f"{ratio:6.2f}  {name}{'  slower' if ratio > LIMIT else ''}" for name, ratio in ordered
    )


def measure(tree: Path, arguments: Sequence[str], results: Path) -> dict[str, Any]:
    """Runs the benchmarks of a tree in its own environment; raises Incomparable."""
    python = tree / ".venv" / "bin" / "python"
    if not python.exists():
        raise Incomparable(f"{tree}: no .venv; `make bench` there first")
    command = [str(python.absolute()), "-m", "pytest", "tests/benchmarks", "--benchmark-only"]
    command += [f"--benchmark-json={results}", *arguments]
    finished = subprocess.run(command, cwd=tree, capture_output=True, text=True, check=False)
    if finished.returncode != 0 or not results.exists():
        raise Incomparable(f"{tree}: the benchmarks failed:\n{finished.stdout}{finished.stderr}")
    return json.loads(results.read_text())


def main(argv: Sequence[str] | None = None) -> int:
    """Measures both trees in turns and prints the ratios; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("base", type=Path)
    parser.add_argument("head", type=Path)
    parser.add_argument("--rounds", type=int, default=DEFAULT_ROUNDS)
    options, rest = parser.parse_known_args(argv)
    base, head = [], []
    try:
        with tempfile.TemporaryDirectory() as folder:
            for turn in range(options.rounds):
                for name, tree, results in (
                    ("base", options.base, base),
                    ("head", options.head, head),
                ):
                    results.append(measure(tree, rest, Path(folder) / f"{name}_{turn}.json"))
        found = ratios(base, head)
    except Incomparable as error:
        print(error, file=sys.stderr)
        return INCOMPARABLE
    print(table(found))
    return SLOWER if max(found.values()) > LIMIT else 0


if __name__ == "__main__":
    sys.exit(main())
