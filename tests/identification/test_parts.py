"""The parts of an identification, by numbers that can be checked by hand."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.identification.budget import Budget, drive_design, parse_budget
from drake_navbench.identification.design import design_points, point_of, settings_at
from drake_navbench.identification.emulator import (
    Driven,
    driven_of,
    emulator_of,
    kernels_of,
    places_of,
)
from drake_navbench.identification.folds import Context, Fit, Fold, Search, folds_of
from drake_navbench.identification.gaussian_process import GaussianProcess, Kernel, fit_kernel
from drake_navbench.identification.layouts import LAYOUTS, with_layout
from drake_navbench.identification.minimum import snapped
from drake_navbench.identification.profile import Profile, profiles
from drake_navbench.identification.ranges import grid_of, place_of, value_at
from drake_navbench.identification.scores import ceiling, mean_error, score
from drake_navbench.identification.seeds import is_told
from drake_navbench.identification.targets import Cell, Pair, Targets, published_targets
from drake_navbench.identification.unknowns import Block, Settings, load_unknowns
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


def test_of_a_time_as_much_is_driven_as_leaves_the_rest_for_the_folds(tmp_path, monkeypatch):
    """Each setting takes 2 s; 100 s are 50 settings, of which 3 folds need 10 each."""
    clock = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    driven = []

    def drive(first: int, last: int) -> None:
        driven.append((first, last))
        clock[0] += 2.0 * (last - first)

    notes = tmp_path / "driven.json"
    assert drive_design(Budget(seconds=100.0), 3, 10, drive, notes) == 16
    assert driven == [(0, 8), (8, 16)]
    # With twice the time a run goes on from there: 100 settings, of which 70 are left.
    assert drive_design(Budget(seconds=200.0), 3, 10, drive, notes) == 64
    assert driven[2:] == [(first, first + 8) for first in range(16, 64, 8)]


def test_of_a_number_the_folds_own_settings_are_taken_off(tmp_path):
    assert drive_design(Budget(evaluations=630), 3, 10, lambda *ends: None, tmp_path) == 600
    driven = []
    count = drive_design(
        Budget(evaluations=50), 3, 10, lambda *ends: driven.append(ends), tmp_path / "driven.json"
    )
    assert count == 20
    assert driven == [(0, 8), (8, 16), (16, 20)]


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


def test_a_goal_at_a_bearing_is_as_far_and_faces_away_from_the_start():
    shipped = load_scenario("restricted_small")
    scenario = with_layout(shipped, {"bearing_deg": 30.0})
    assert scenario.goal == pytest.approx((8.8 * math.sqrt(0.75), 4.4, math.pi / 6.0))
    for ours, theirs in zip(scenario.world.obstacles, shipped.world.obstacles, strict=True):
        assert np.allclose(ours.outline, theirs.outline, atol=1e-6)


def test_noise_at_the_wall_is_a_share_of_the_noise_elsewhere():
    unknowns = load_unknowns(None, published_targets(), "wheelchair")
    settings = Settings(base={"localization.xy_std_m": 0.01, "wall_noise_ratio": 0.25})

    def noise_m(name: str) -> float:
        shipped = load_scenario(name)
        changed = unknowns.scenario(shipped, settings, shipped)
        return changed.load_robot("wheelchair").localization.xy_std_m

    assert noise_m("one_obstacle") == 0.01
    assert noise_m("restricted_small") == 0.0025


def planted_deviation(places):
    """Of a cell: right in the middle of its unknowns, wrong altogether where all are at an end."""
    return 2.0 * places.mean(axis=-1) - 1.0


def planted_context(blocks, targets, points):
    """What searches have in common, and what was driven: see `planted_deviation`."""
    places = places_of(blocks, targets.values)
    deviations = {cell: points[:, places[cell]].mean(axis=1) - 0.5 for cell in list(targets.values)}
    kernel = {cell: Kernel(np.full(len(places[cell]), 1.5), 0.1) for cell in targets.values}
    return Context(kernel, places, targets, seed=0), Driven(points, deviations)


def test_no_search_of_a_fold_sees_a_cell_that_is_held_out():
    targets = published_targets()
    unknowns = load_unknowns(None, targets, "wheelchair")
    points = design_points(unknowns.blocks, 16, seed=0)
    context, design = planted_context(unknowns.blocks, targets, points)
    folds = folds_of(targets)
    assert len(folds) == 1 + 5 + 4
    for fold in folds:
        search = Search(fold, unknowns.blocks, targets.values, design, context)
        fit = search.fit()
        assert len(fit.cells) == len(fit.emulator.driven.deviations) == len(fit.emulator.processes)
        assert not any(fold.is_held_out(cell) for cell in fit.emulator.processes)
        assert not any(fold.is_held_out(pair) for pair in search.pairs)
        # Of what only held-out cells tell nothing is found.
        assert fold.scenario not in fit.settings.layouts
        assert fold.controller not in fit.settings.own
        assert len(fit.settings.layouts) + len(fit.settings.own) == (9 if fold == Fold() else 8)


def test_a_fold_finds_the_settings_where_its_cells_are_right():
    targets = published_targets().only(["empty", "restricted_small"], ["rpp", "dwb"])
    unknowns = load_unknowns(None, targets, "wheelchair")
    points = design_points(unknowns.blocks, 64, seed=0)
    context, design = planted_context(unknowns.blocks, targets, points)
    search = Search(Fold(), unknowns.blocks, targets.values, design, context)
    before = search.fit().error
    for _ in range(3):
        proposed = search.proposal()
        point = point_of(unknowns.blocks, proposed)
        numbers = {
            cell: value + targets.scales[cell] * planted_deviation(point[context.places[cell]])
            for cell, value in targets.values.items()
        }
        search.learn(proposed, numbers)
    assert before > 0.01
    assert search.fit().error < 0.4 * before


def test_settings_that_cannot_be_driven_are_as_far_off_as_can_be():
    targets = Targets(row(rpp=10.0), {("empty", "time_taken"): 0.01})
    driven = driven_of(np.zeros((3, 1)), [row(rpp=11.0), {}, row(rpp=math.nan)], [CELL], targets)
    assert driven.errors([CELL]).tolist() == pytest.approx([0.1, 1.0, 1.0])


def test_a_layout_is_told_by_its_scenario_and_own_settings_by_their_column():
    targets = published_targets()
    blocks = load_unknowns(None, targets, "wheelchair").blocks
    owners = [block for block in blocks for _ in block.dimensions]
    for cell, places in places_of(blocks, targets.values).items():
        names = {owners[place].name for place in places}
        assert names == {"base", cell.scenario, cell.controller}


def test_more_points_of_a_design_begin_with_the_same_ones_and_are_found_again_from_settings():
    blocks = load_unknowns(None, published_targets(), "wheelchair").blocks
    few, many = design_points(blocks, 8, seed=1), design_points(blocks, 24, seed=1)
    assert (many[:8] == few).all()
    assert not (design_points(blocks, 8, seed=2) == few).all()
    settings = settings_at(blocks, few[3])
    point = point_of(blocks, settings)
    assert settings_at(blocks, point) == settings
    # What was rounded moved by no more than half a choice of two.
    assert np.abs(point - few[3]).max() <= 0.5


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


BLOCK = Block("base", "base", DIMENSIONS, {})
CELL = Cell("empty", "time_taken", "rpp")


def fit_of(points, deviations) -> Fit:
    """What is known of one cell that hangs on one block."""
    places = places_of([BLOCK], [CELL])
    driven = Driven(points, {CELL: deviations})
    emulator = emulator_of(driven, kernels_of(driven, places), places)
    best = int(np.argmin(np.abs(deviations)))
    settings = settings_at([BLOCK], points[best])
    return Fit(settings, (BLOCK,), (CELL,), abs(deviations[best]), points[best], emulator)


def test_a_profile_tells_what_matters_and_says_of_the_rest_that_it_does_not():
    points = snapped([BLOCK], design_points([BLOCK], 96, seed=0))
    generator = np.random.default_rng(0)
    length, weight, way = points[:, 0], points[:, 1], points[:, 4]
    deviations = (
        2.0 * (length - 0.65) ** 2
        + 2.0 * (weight - 0.5) ** 2
        + np.where(way == 0.0, 0.3, 0.0)
        + generator.normal(0.0, 0.003, size=len(points))
    )
    fit = fit_of(points, deviations)
    found = {profile.name: profile for profile in profiles([BLOCK], BLOCK, fit)}
    # 0.65 of the range from 0 to 2, and the middle between 1 and 100 by factors.
    assert found["length"].low <= 1.3 <= found["length"].high
    assert found["length"].high - found["length"].low < 1.0
    assert found["weight"].low <= 10.0 <= found["weight"].high
    assert found["length"].is_told
    assert found["weight"].is_told
    assert not found["idle"].is_told
    assert not found["count"].is_told
    assert "left" not in found["way"].as_good


def test_a_profile_of_mere_chance_tells_nothing():
    points = snapped([BLOCK], design_points([BLOCK], 32, seed=0))
    deviations = np.random.default_rng(1).normal(0.5, 0.05, size=len(points))
    assert not any(p.is_told for p in profiles([BLOCK], BLOCK, fit_of(points, deviations)))


def test_a_gaussian_process_foretells_a_smooth_function_and_knows_how_well():
    generator = np.random.default_rng(0)
    points, others = generator.random((60, 3)), generator.random((200, 3))

    def function(at):
        return np.sin(3.0 * at[:, 0]) + at[:, 1] ** 2

    process = GaussianProcess(fit_kernel(points, function(points)), points, function(points))
    foretold = process.foretell(others)
    errors = foretold.means - function(others)
    assert np.abs(errors).max() < 0.05
    # The third dimension does not matter: its length scale is the longest.
    assert np.argmax(process.kernel.lengths) == 2
    assert np.mean(np.abs(errors) < 3.0 * foretold.deviations) > 0.95
    left_out = process.foretell_left_out()
    by_hand = GaussianProcess(process.kernel, points[1:], function(points[1:])).foretell(points[:1])
    assert left_out.means[0] == pytest.approx(by_hand.means[0], abs=2e-3)


def test_an_expected_error_counts_what_is_not_known():
    """Far from all that was driven a deviation of 0 +- s is off by s sqrt(2 / pi)."""
    kernel = Kernel(np.array([0.01]), 0.001)
    points, deviations = np.array([[0.2], [0.4]]), np.array([-0.1, 0.1])
    driven = Driven(points, {CELL: deviations})
    emulator = emulator_of(driven, {CELL: kernel}, {CELL: np.array([0])})
    near, far = emulator.expected_errors(np.array([[0.2], [0.9]]), [CELL])
    assert near == pytest.approx(0.1, abs=1e-3)
    assert far == pytest.approx(0.1 * math.sqrt(2.0 / math.pi), abs=1e-3)


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
