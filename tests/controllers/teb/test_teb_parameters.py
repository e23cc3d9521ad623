import numpy as np
import pytest
from controller_scenes import make_setup
from pydantic import ValidationError
from scenes import WHEELCHAIR

from drake_navbench.controller import SpeedLimit
from drake_navbench.controllers.teb import TimedElasticBand
from drake_navbench.controllers.teb.parameters import DiscModel, TebParameters
from drake_navbench.controllers.teb.planner import band_limits
from drake_navbench.errors import InputError


@pytest.mark.parametrize(
    ("values", "names"),
    [
        ({"acc_lim_x": 0.0}, ["acc_lim_x", "greater than 0"]),
        ({"acc_lim_theta": -1.0}, ["acc_lim_theta", "greater than 0"]),
        ({"dt_ref": 0.0}, ["dt_ref"]),
        ({"dt_ref": 0.3, "dt_hysteresis": 0.3}, ["dt_hysteresis", "dt_ref", "0.3"]),
        ({"min_samples": 2}, ["min_samples", "at least 3", "2"]),
        ({"min_samples": 9, "max_samples": 5}, ["max_samples", "min_samples", "5", "9"]),
        ({"max_vel_x": 0.0}, ["max_vel_x"]),
        ({"max_vel_y_typo": 0.0}, ["max_vel_y_typo"]),
        ({"footprint_model": {"type": "lin"}}, ["footprint_model"]),
        ({"footprint_model": {"type": "line"}}, ["line_start", "line_end"]),
        ({"footprint_model": {"type": "polygon"}}, ["vertices: got 0, expected at least 3"]),
        ({"weight_optimaltime": 0.0}, ["weight_optimaltime"]),
    ],
)
def test_contradictory_values_are_refused_by_name(values, names):
    with pytest.raises(ValidationError) as caught:
        TebParameters(**values)
    for name in names:
        assert name in str(caught.value)


def test_a_clearance_above_the_corridor_is_refused_in_one_line():
    with pytest.raises(InputError, match=r"min_obstacle_dist = 3.0 m .* 6.0 m") as caught:
        TimedElasticBand(TebParameters(min_obstacle_dist=3.0), make_setup())
    assert "\n" not in str(caught.value)


def test_defaults_are_those_of_upstream():
    parameters = TebParameters()
    assert (parameters.dt_ref, parameters.dt_hysteresis) == (0.3, 0.1)
    assert (parameters.max_vel_x, parameters.max_vel_theta) == (0.4, 0.3)
    assert (parameters.min_obstacle_dist, parameters.inflation_dist) == (0.5, 0.6)
    assert parameters.no_inner_iterations * parameters.no_outer_iterations == 20


def test_upstream_parameters_without_effect_are_accepted():
    given = {"penalty_epsilon": 0.1, "weight_obstacle": 50.0, "costmap_converter_plugin": ""}
    assert TebParameters(**given) == TebParameters()


def test_used_and_unused_names_are_disjoint():
    assert not TebParameters.WITHOUT_EFFECT & set(TebParameters.model_fields)


def test_footprint_models_become_discs():
    setup = make_setup()
    two = DiscModel(
        type="two_circles", front_offset=0.5, front_radius=0.3, rear_offset=0.1, rear_radius=0.2
    )
    np.testing.assert_allclose(two.discs(setup), [[0.5, 0.3], [-0.1, 0.2]])
    np.testing.assert_allclose(DiscModel(type="point").discs(setup), [[0.0, 0.0]])
    circular = DiscModel(type="circular", radius=0.4)
    np.testing.assert_allclose(circular.discs(setup), [[0.0, 0.4]])
    derived = DiscModel().discs(setup)
    line = DiscModel(type="line", line_start=(-0.1, 0.05), line_end=(0.4, 0.0))
    np.testing.assert_allclose(line.discs(setup), [[-0.1, 0.05], [0.15, 0.05], [0.4, 0.05]])
    box = DiscModel(type="polygon", vertices="[[0.5, 0.2], [0.5, -0.2], [-0.1, -0.2], [-0.1, 0.2]]")
    np.testing.assert_allclose(box.discs(setup), [[0.1, 0.2], [0.3, 0.2]])
    assert derived[:, 0].max() + derived[0, 1] == pytest.approx(WHEELCHAIR[:, 0].max())


def test_at_least_half_of_the_clearance_is_kept():
    assert band_limits(TebParameters(min_obstacle_dist=0.3), None).largest_slack == 0.15


def test_a_speed_limit_scales_all_speeds():
    parameters = TebParameters(max_vel_x=0.5, max_vel_x_backwards=0.2, max_vel_theta=1.0)
    for limit in (SpeedLimit(0.25), SpeedLimit(50.0, is_percentage=True)):
        limits = band_limits(parameters, limit)
        assert (limits.forward_speed, limits.backward_speed) == pytest.approx((0.25, 0.1))
        assert limits.turn_rate == pytest.approx(0.5)
    for unlimited in (None, SpeedLimit(0.0), SpeedLimit(9.0)):
        assert band_limits(parameters, unlimited).forward_speed == 0.5
