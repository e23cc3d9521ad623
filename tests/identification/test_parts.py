"""The parts of an identification, by numbers that can be checked by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.identification.budget import Budget, parse_budget, shares
from drake_navbench.identification.folds import Fold, folds_of, tasks_of
from drake_navbench.identification.layouts import LAYOUTS, with_layout
from drake_navbench.identification.profile import Profile, profiles
from drake_navbench.identification.ranges import grid_of, place_of, value_at
from drake_navbench.identification.scores import ceiling, mean_error, score
from drake_navbench.identification.search import Evaluation
from drake_navbench.identification.seeds import is_told
from drake_navbench.identification.targets import Cell, Pair, Targets, published_targets
from drake_navbench.identification.unknowns import Settings, load_unknowns
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, load_scenario
from drake_navbench.tuning.search_space import Dimension


def row(**values: float) -> dict[Cell, float]:
    return {Cell("empty", "time_taken", name): value for name, value in values.items()}


TARGETS = Targets(row(rpp=10.0, dwb=20.0, teb=20.05, mppi=0.0), {("empty", "time_taken"): 0.01})


def test_errors_are_relative_and_none_counts_more_than_all_of_a_number():
    ours = row(rpp=11.0, dwb=100.0, mppi=4.01)
    # 10%; 400%, which counts 100%; no value, 100%; 4.01 of the row's largest number, 20.05.
    assert mean_error(list(TARGETS.values), ours, TARGETS) == pytest.approx((0.1 + 1 + 1 + 0.2) / 4)


def test_orderings_leave_out_ties_and_what_has_no_value():
    ours = row(rpp=5.0, dwb=4.0, teb=3.0)
    # Of six pairs dwb and teb are a tie, and three hold mppi, which has no value here.
    found = score(list(TARGETS.values), ours, TARGETS)
    assert (found.orderings, found.agreeing) == (2, 0.0)
    # Relative errors of 50%, 80% and 85%; of nothing there is none.
    assert found.cells == 3
    assert found.median_error == pytest.approx(0.8)


def test_one_controller_is_ordered_against_the_others():
    others = row(dwb=30.0, teb=1.0, mppi=2.0)
    found = score([Cell("empty", "time_taken", "rpp")], row(rpp=15.0), TARGETS, others)
    # Below dwb as in the tables, above mppi likewise, and not below teb.
    assert (found.orderings, found.agreeing) == (3, 2.0)


def test_the_ceiling_compares_two_runs_of_ours_without_what_is_never_random():
    first, second = row(rpp=1.0, dwb=2.0, teb=3.0), row(rpp=1.0, dwb=3.0, teb=2.0)
    found = ceiling(first, second, TARGETS, fixed=())
    assert (found.orderings, found.agreeing) == (3, 2.0)
    found = ceiling(first, second, TARGETS, fixed=[Pair("empty", "rpp"), Pair("empty", "dwb")])
    assert (found.orderings, found.agreeing) == (2, 1.0)


@pytest.mark.parametrize(
    ("text", "budget"),
    [
        ("600", Budget(evaluations=600)),
        ("90s", Budget(seconds=90.0)),
        ("40min", Budget(seconds=2400.0)),
        ("2.5h", Budget(seconds=9000.0)),
    ],
)
def test_a_budget_is_a_number_of_evaluations_or_a_time(text, budget):
    assert parse_budget(text) == budget


@pytest.mark.parametrize("text", ["", "-5", "2.5", "1d", "0h", "nan", "1e3"])
def test_other_budgets_are_refused(text):
    with pytest.raises(InputError, match="--budget"):
        parse_budget(text)


def test_time_is_shared_by_what_has_to_be_driven_but_nobody_gets_less_than_the_least():
    first, second = shares(Budget(seconds=100.0), [1, 3])
    assert (first.seconds, second.seconds) == (25.0, 75.0)
    assert not first.is_used_up(7, 1000.0)
    assert first.is_used_up(8, 25.0)
    assert not first.is_used_up(8, 24.0)


@pytest.mark.parametrize("name", PUBLISHED_SCENARIOS)
def test_shipped_dimensions_give_the_shipped_scenario(name):
    """To the millimetre: each dimension a hair off, then back by rounding."""
    shipped = load_scenario(name)
    nearly = {key: value + 1e-7 for key, value in LAYOUTS[name].shipped.items()}
    built = with_layout(shipped, nearly)
    assert with_layout(shipped, LAYOUTS[name].shipped) is shipped
    assert built is not shipped
    assert built.name == name
    assert np.allclose(built.goal, shipped.goal, atol=2e-3)
    assert len(built.world.obstacles) == len(shipped.world.obstacles)
    for ours, theirs in zip(built.world.obstacles, shipped.world.obstacles, strict=True):
        assert np.allclose(ours.outline, theirs.outline, atol=2e-3)
        assert ours.known_to_planner is theirs.known_to_planner
    assert [type(entry) for entry in built.filters] == [type(entry) for entry in shipped.filters]
    for ours, theirs in zip(built.filters, shipped.filters, strict=True):
        for mine, other in zip(ours.areas, theirs.areas, strict=True):
            assert np.allclose(mine.polygon, other.polygon, atol=2e-3)
    assert built.plan.type == shipped.plan.type
    if shipped.plan.type == "elements":
        ours, theirs = (
            [list(element.model_dump().values()) for element in scenario.plan.elements]
            for scenario in (built, shipped)
        )
        assert all(np.allclose(a, b, atol=1e-3) for a, b in zip(ours, theirs, strict=True))
    assert built.robot_overrides == shipped.robot_overrides


def test_a_wall_is_moved_and_the_box_stays_closed():
    scenario = with_layout(load_scenario("restricted_large"), {"front_m": 4.0})
    front, back, left, right = (box.outline for box in scenario.world.obstacles)
    assert front[:, 0].min() == pytest.approx(4.0)
    assert back[:, 0].max() == pytest.approx(-3.175)
    for side in (left, right):
        assert side[:, 0].max() == pytest.approx(4.125)


def test_noise_at_the_wall_is_a_share_of_the_noise_elsewhere():
    unknowns = load_unknowns(None, published_targets(), "wheelchair")
    settings = Settings(base={"localization.xy_std_m": 0.01, "wall_noise_ratio": 0.25})

    def noise_m(name: str) -> float:
        shipped = load_scenario(name)
        changed = unknowns.scenario(shipped, settings, shipped)
        return changed.load_robot("wheelchair").localization.xy_std_m

    assert noise_m("one_obstacle") == 0.01
    assert noise_m("restricted_small") == 0.0025


def test_no_search_of_a_fold_sees_a_cell_that_is_held_out():
    targets = published_targets()
    unknowns = load_unknowns(None, targets, "wheelchair")
    folds = folds_of(targets)
    assert len(folds) == 1 + 5 + 4
    for fold in folds:
        tasks = list(tasks_of(fold, unknowns, targets))
        assert tasks
        for task in tasks:
            for cell in task.cells:
                assert cell.scenario != fold.scenario
                assert cell.controller != fold.controller
        if fold.controller:
            assert "own" not in {task.block.kind for task in tasks}


def test_a_layout_is_searched_by_its_scenario_and_own_settings_by_their_column():
    targets = published_targets()
    for task in tasks_of(Fold(), load_unknowns(None, targets, "wheelchair"), targets):
        if task.block.kind == "layouts":
            assert {cell.scenario for cell in task.cells} == {task.block.name}
        if task.block.kind == "own":
            assert {cell.controller for cell in task.cells} == {task.block.name}


DIMENSIONS = (
    Dimension("length", low=0.0, high=2.0),
    Dimension("weight", low=1.0, high=100.0, is_logarithmic=True),
    Dimension("idle", low=0.0, high=1.0),
    Dimension("count", low=5, high=9, is_whole=True),
    Dimension("way", choices=("left", "straight", "right")),
)


@pytest.mark.parametrize("dimension", DIMENSIONS, ids=lambda entry: entry.name)
def test_places_of_values_are_found_again(dimension):
    values = grid_of(dimension)
    assert place_of(dimension, values[0]) == 0.0
    assert place_of(dimension, values[-1]) == 1.0
    assert [value_at(dimension, place_of(dimension, value)) for value in values] == values


def test_a_profile_tells_what_matters_and_says_of_the_rest_that_it_does_not():
    generator = np.random.default_rng(0)
    evaluations = []
    for _ in range(48):
        values = {d.name: value_at(d, float(generator.random())) for d in DIMENSIONS}
        error = (
            (values["length"] - 1.3) ** 2
            + math.log10(values["weight"] / 10.0) ** 2
            + (0.3 if values["way"] == "left" else 0.0)
            + generator.normal(0.0, 0.003)
        )
        evaluations.append(Evaluation(values, error))
    found = {profile.name: profile for profile in profiles(DIMENSIONS, evaluations)}
    assert found["length"].low <= 1.3 <= found["length"].high
    assert found["length"].high - found["length"].low < 1.0
    assert found["weight"].low <= 10.0 <= found["weight"].high
    assert found["length"].is_told
    assert found["weight"].is_told
    assert not found["idle"].is_told
    assert not found["count"].is_told
    assert "left" not in found["way"].as_good


def test_a_profile_of_mere_chance_tells_nothing():
    generator = np.random.default_rng(1)
    evaluations = [
        Evaluation({d.name: value_at(d, float(generator.random())) for d in DIMENSIONS}, error)
        for error in generator.normal(1.0, 0.1, size=32)
    ]
    assert not any(profile.is_told for profile in profiles(DIMENSIONS, evaluations))


def test_several_seeds_tell_a_value_where_all_that_is_as_good_lies_within_half_of_the_range():
    length = DIMENSIONS[0]
    # Of 2 m: 0.1, 0.2 and 0.5 of the range.
    first = Profile("length", 1.0, 0.9, 1.1, (), 0.1)
    second = Profile("length", 1.3, 1.2, 1.6, (), 0.2)
    far = Profile("length", 0.2, 0.0, 1.0, (), 0.5)
    assert is_told(length, [first])
    # 0.9 to 1.6 m; then 0 to 1.1 m, which is more than half.
    assert is_told(length, [first, second])
    assert not is_told(length, [first, far])
    blank = Profile("length", 1.0, 0.0, 2.0, (), 1.0)
    assert not is_told(length, [first, blank])
    way = DIMENSIONS[4]
    left = Profile("way", "left", "left", "left", ("left",), 1 / 3)
    right = Profile("way", "right", "right", "right", ("right",), 1 / 3)
    assert is_told(way, [left, left])
    assert not is_told(way, [left, right])
