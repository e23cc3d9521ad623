"""Sweeps: what an axis says, which trials it makes, how they are paired."""

import pytest

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.sweep import parse_axis, points_of, swept_points
from drake_navbench.errors import InputError


def values(text):
    return parse_axis(text).values


def test_an_axis_is_a_list_or_a_range():
    assert values("rpp.lookahead_dist=0.3,0.6") == (0.3, 0.6)
    assert values("rpp.use_rotate_to_heading=true,false") == (True, False)
    assert values("localization.xy_std_m=0:0.05:3") == (0.0, 0.025, 0.05)
    assert values("mppi.temperature=0.1:10:3:log") == (0.1, 1.0, 10.0)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("rpp.lookahead_dist", "expected FIELD=VALUE"),
        ("a=1,1", "every value once"),
        ("a=2:1:3", "from a lower to a higher number"),
        ("a=0:1:1", "whole number from 2 on"),
        ("a=0:1:3:log", "begins above 0"),
        ("a=x:1:3", "expected a number"),
        ("a=0:inf:3", "expected a number"),
    ],
)
def test_what_is_no_axis_is_told(text, told):
    with pytest.raises(InputError, match=told):
        parse_axis(text)


def test_a_grid_has_every_combination_and_needs_counts():
    axes = [parse_axis("a=1,2"), parse_axis("b=0:1:3")]
    assert len(points_of(axes)) == 6
    assert points_of(axes)[1] == {"a": 1, "b": 0.5}
    with pytest.raises(InputError, match="the number of values"):
        points_of([parse_axis("a=0:1")])
    with pytest.raises(InputError, match="given twice"):
        points_of([parse_axis("a=1,2"), parse_axis("a=3,4")])
    with pytest.raises(InputError, match="at most 10000"):
        points_of([parse_axis("a=0:1:101"), parse_axis("b=0:1:100")])


def test_a_latin_hypercube_has_one_point_in_each_part_of_each_axis():
    axes = [parse_axis("a=0:1"), parse_axis("b=10,20,30,40")]
    points = points_of(axes, samples=4, seed=1)
    assert sorted(int(4 * point["a"]) for point in points) == [0, 1, 2, 3]
    assert sorted(point["b"] for point in points) == [10, 20, 30, 40]
    assert points == points_of(axes, samples=4, seed=1)
    assert points != points_of(axes, samples=4, seed=2)


def test_a_latin_hypercube_spaces_a_logarithmic_range_by_a_constant_factor():
    points = points_of([parse_axis("a=0.01:100:3:log")], samples=4, seed=1)
    # A quarter of the axis is a factor of ten.
    assert [int(10.0 * p["a"]) > 0 for p in sorted(points, key=lambda p: p["a"])] == [
        False, True, True, True,
    ]  # fmt: skip
    assert [bound < p["a"] <= 10 * bound for bound, p in zip(
        (0.01, 0.1, 1.0, 10.0), sorted(points, key=lambda p: p["a"]), strict=True
    )] == [True] * 4  # fmt: skip


def sweep(*texts, scenarios=("empty",), presets=("rpp", "dwb"), samples=None, **options):
    points = swept_points(texts, samples=samples, seed=options.get("seed", 0))
    return plan_campaign(scenarios, presets, trials=2, points=points, **options)


def test_a_field_of_the_robot_makes_scenarios_and_one_of_a_controller_columns():
    campaign = sweep("localization.xy_std_m=0.0,0.02", "rpp.lookahead_dist=0.3,0.9")
    assert campaign.scenarios == [
        "empty@localization.xy_std_m=0",
        "empty@localization.xy_std_m=0.02",
    ]
    assert campaign.columns == ["rpp:lookahead_dist=0.3", "dwb", "rpp:lookahead_dist=0.9"]
    # 2 scenarios x 3 columns x 2 trials: dwb does not drive again for a field that it lacks.
    assert len(campaign.specs) == 12
    noises = {spec.robot.localization.xy_std_m for spec in campaign.specs}
    assert noises == {0.0, 0.02}
    last = campaign.specs[-1].preset
    assert last.name == "rpp:lookahead_dist=0.9"
    assert last.parameters.lookahead_dist == 0.9
    assert campaign.sweep["controllers"]["rpp:lookahead_dist=0.9"] == {
        "of": "rpp",
        "values": {"rpp.lookahead_dist": 0.9},
    }


def test_trials_are_paired_over_all_points_and_with_the_run_without_a_sweep():
    seeds = {spec.seed for spec in sweep("localization.xy_std_m=0,0.02").specs}
    assert seeds == {spec.seed for spec in sweep().specs}
    assert len(seeds) == 2


def test_a_field_of_the_scenario_is_swept_too():
    campaign = sweep("variation.start_xy_std_m=0.1,0.2", "scenario.timeout_s=10,20")
    found = {(s.scenario.variation.start_xy_std_m, s.scenario.timeout_s) for s in campaign.specs}
    assert found == {(0.1, 10.0), (0.1, 20.0), (0.2, 10.0), (0.2, 20.0)}


def test_a_range_between_whole_numbers_fits_parameters_that_count():
    assert list(map(type, values("dwb.vx_samples=5:15:3"))) == [int, int, int]
    assert list(map(type, values("dwb.sim_time=1:2:3"))) == [int, float, int]
    assert list(map(type, values("dwb.sim_time=1.0:2.0:2"))) == [float, float]
    campaign = sweep("dwb.vx_samples=5:15:3", presets=("dwb",))
    assert campaign.columns == [f"dwb:vx_samples={count}" for count in (5, 10, 15)]


def test_samples_give_every_column_its_own_point():
    campaign = sweep("rpp.lookahead_dist=0.3:0.9", "timeout_s=10:20", samples=3)
    # rpp at three points and dwb at the three time limits of these, twice each.
    assert len(campaign.specs) == 12
    assert len(campaign.scenarios) == 3
    assert len(campaign.columns) == 4


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("rpp.lookahead_dst=1,2", "lookahead_dst: unknown field; did you mean 'lookahead_dist'"),
        ("localization.xy=1,2", "localization.xy: unknown field"),
        ("localisation.xy_std_m=1,2", "did you mean 'localization.xy_std_m'"),
        ("localization.xy_std_m=-1,2", "greater than or equal to 0, got -1"),
        ("name=a,b", "expected COLUMN.PARAMETER"),
        # Fields are found by their last name, too; thirty names help nobody.
        ("lookahead_dist=1,2", r"got 'lookahead_dist'; did you mean 'rpp.lookahead_dist'\?$"),
        ("inflation_radius=1,2", r"costmap.inflation_layer.inflation_radius' or 'navigation.local"),
        ("xyzzy=1,2", "got 'xyzzy'$"),
    ],
)
def test_a_field_or_value_that_cannot_be_is_one_line(text, told):
    with pytest.raises(InputError, match=told) as raised:
        sweep(text)
    assert "--sweep" in str(raised.value)
    assert "\n" not in str(raised.value)


def test_samples_want_a_sweep():
    with pytest.raises(InputError, match="expected --sweep as well"):
        sweep(samples=3)
