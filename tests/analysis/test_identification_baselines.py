"""The figures of docs/identification.md: what rules without skill foretell of the tables."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def baselines():
    spec = importlib.util.spec_from_file_location(
        "baselines", DOCS.parent / "studies" / "identification_baselines.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_mean_of_the_other_three_controllers_is_off_by_a_ninth(baselines):
    errors = baselines.errors_of_row_means()
    # 50 rows of 4, of which 4 numbers are 0.
    assert len(errors) == 196
    assert np.median(errors) == pytest.approx(0.118, abs=5e-4)
    # empty, avg_linear_speed, dwb: (0.500 + 0.476 + 0.459) / 3 / 0.466 - 1.
    assert errors[0] == pytest.approx(0.02647, abs=1e-5)


@pytest.mark.parametrize(("ties_vote", "right"), [(True, 203.0), (False, 198.0)])
def test_the_majority_of_other_scenarios_knows_three_of_four_orderings(baselines, ties_vote, right):
    assert baselines.votes_of_other_scenarios(ties_vote=ties_vote) == (right, 275)


def test_the_page_tells_these_figures():
    page = (DOCS / "identification.md").read_text(encoding="utf-8")
    assert "11.8%" in page
    assert "203, 73.8%" in page
    assert "198 (72.0%)" in page
