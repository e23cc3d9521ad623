"""Every two columns are compared once, and their p-values corrected together."""

import numpy as np
import pandas as pd
import pytest

from drake_navbench.analysis.every_pair import compare_every_pair
from drake_navbench.analysis.statistics import paired_comparison


def test_of_three_columns_three_pairs_are_corrected_together():
    seeds = np.arange(8)
    columns = {
        "a": pd.Series(0.0 * seeds),
        "b": pd.Series(1.0 + seeds),
        "c": pd.Series(2.0 + seeds),
    }
    pairs = compare_every_pair(columns, lambda x, y: paired_comparison(columns[x], columns[y]))
    assert [(pair.first, pair.second) for pair in pairs] == [("a", "b"), ("a", "c"), ("b", "c")]
    assert pairs[2].comparison.difference == 1.0
    # Eight differences of one sign: 2 / 2^8 each, times the three of them.
    assert [pair.p_holm for pair in pairs] == pytest.approx([6 / 256] * 3)


def test_of_one_column_there_is_no_pair():
    assert compare_every_pair(["a"], paired_comparison) == []
