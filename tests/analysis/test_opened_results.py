"""A results folder in Python: opened again, judged, drawn and compared."""

from __future__ import annotations

import pytest
from results_folders import measured_folder

from drake_navbench.campaign.run_results import Results
from drake_navbench.errors import InputError


def test_a_folder_is_opened_again_with_its_trials(tmp_path):
    folder = measured_folder(tmp_path / "kept")
    opened = Results.open(folder)
    assert len(opened) == 12
    assert set(opened.trials["controller"]) == {"rpp", "rpp:v=0.4"}
    assert opened.best("time_to_goal_s") == "rpp"
    assert opened.best("time_to_goal_s", "empty") == "rpp"
    # Both keep the same distance from the wall: nobody is best.
    assert opened.best("min_clearance_m") is None
    assert opened.plot("time_to_goal_s")._repr_png_().startswith(b"\x89PNG")
    for call in (opened.best, opened.plot):
        with pytest.raises(InputError, match="did you mean 'time_to_goal_s'"):
            call("time_to_gaol_s")
        with pytest.raises(InputError, match="metric 'outcome' is unknown"):
            call("outcome")
    with pytest.raises(InputError, match="not a results folder"):
        Results.open(tmp_path)


def test_two_results_are_compared_as_the_command_does(tmp_path):
    first, second = (
        Results.open(measured_folder(tmp_path / name, slower=slower, is_random=False))
        for name, slower in (("first", 1.0), ("second", 1.1))
    )
    text = str(first.compare(second))
    assert "is worse than before, in time to the goal" in text
    assert str(first.compare(second.path)) == text
    # Without another folder the columns of one: 0.4 m/s take longer than 0.5 m/s.
    assert "rpp:v=0.4 is worse than rpp, in time to the goal" in str(first.compare())
