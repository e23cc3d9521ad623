"""Claims of the publication that hold with its controllers' names exchanged: docs/reproduction.md.

`python studies/reproduction_exchanged.py FOLDER` judges the trials of a default run under each of
the 24 assignments of our four columns to the published names. An assignment that knows nothing
about the controllers keeps the scenarios and the differences between the columns.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pandas as pd

from drake_navbench import Results
from drake_navbench.analysis.repeats import repeated_cells
from drake_navbench.analysis.reproduction.judgement import FindingVerdict, judge_all
from drake_navbench.analysis.reproduction.lineups import PUBLISHED_SETTINGS
from drake_navbench.commands.command_line import exit_status_of


def verdicts_by_assignment(trials: pd.DataFrame) -> dict[tuple[str, ...], Counter[FindingVerdict]]:
    """Returns the number of claims with each verdict, by the columns in the order of the names."""
    names, columns = zip(*PUBLISHED_SETTINGS.presets.items(), strict=True)
    repeated = repeated_cells(trials)
    found = {}
    for order in permutations(columns):
        lineup = replace(PUBLISHED_SETTINGS, presets=dict(zip(names, order, strict=True)))
        judged = judge_all(trials, lineup, repeated=repeated)
        found[order] = Counter(judgement.verdict for judgement in judged)
    return found


def main() -> int:
    """Runs the study; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path, help="results folder of `drake-navbench run`")
    folder = parser.parse_args().folder

    def show() -> None:
        found = verdicts_by_assignment(Results.open(folder).trials)
        for order, counts in found.items():
            told = ", ".join(f"{counts[verdict]} {verdict}" for verdict in FindingVerdict)
            print(f"{', '.join(order)}: {told}")
        own, *others = (counts[FindingVerdict.HOLDS] for counts in found.values())
        print(
            f"{own} hold with the names as they are; exchanged {np.median(others):g} in the "
            f"median, {min(others)} to {max(others)}"
        )

    return exit_status_of(show)


if __name__ == "__main__":
    raise SystemExit(main())
