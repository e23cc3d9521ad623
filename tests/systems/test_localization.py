"""The estimate is the truth plus noise that holds for a period."""

import numpy as np
from pydrake.systems.analysis import Simulator

from drake_navbench.inputs.localization import LocalizationSettings
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.trial.systems.localization import Localization

STATE = np.array([1.0, -2.0, 0.3, 0.5, 0.1, 0.2])
OFFSET_S = 0.02
SETTINGS = LocalizationSettings(period_s=0.05, xy_std_m=0.01, yaw_std_rad=0.02)


def start(settings=SETTINGS, *, seed=0):
    """Returns a localization and its simulator, the robot at STATE for good."""
    localization = Localization(Timeline.constant(settings), offset_s=OFFSET_S)
    context = localization.CreateDefaultContext()
    context.get_mutable_abstract_parameter(localization.seed_parameter).set_value(seed)
    localization.GetInputPort("state").FixValue(context, STATE)
    simulator = Simulator(localization, context)
    simulator.Initialize()
    return localization, simulator


def errors(time_s, *, seed=0, settings=SETTINGS):
    """Returns estimate minus truth at a time."""
    localization, simulator = start(settings, seed=seed)
    simulator.AdvanceTo(time_s)
    return localization.GetOutputPort("estimate").Eval(simulator.get_context()) - STATE


def test_without_spread_the_estimate_is_the_truth():
    settings = LocalizationSettings(xy_std_m=0.0, yaw_std_rad=0.0)
    np.testing.assert_array_equal(errors(1.0, settings=settings), np.zeros(6))


def test_only_what_has_a_spread_is_noisy():
    assert (errors(0.0) != 0.0).tolist() == [True, True, True, False, False, False]


def test_the_noise_holds_from_one_draw_to_the_next():
    # Drawn at 0.02 s, 0.07 s, 0.12 s, ...
    np.testing.assert_array_equal(errors(0.03), errors(0.06))
    assert not np.array_equal(errors(0.06), errors(0.08))
    assert not np.array_equal(errors(0.01), errors(0.03))


def test_the_seed_alone_decides():
    np.testing.assert_array_equal(errors(0.5, seed=3), errors(0.5, seed=3))
    assert not np.array_equal(errors(0.5, seed=3), errors(0.5, seed=4))


def test_the_noise_has_the_asked_spread():
    localization, simulator = start()
    estimate = localization.GetOutputPort("estimate")
    drawn = []
    for step in range(400):
        simulator.AdvanceTo(OFFSET_S + 0.05 * step + 0.01)
        drawn.append(estimate.Eval(simulator.get_context()) - STATE)
    # The spread of 400 draws is known to 1 / sqrt(800), 3.5 %.
    np.testing.assert_allclose(np.std(drawn, axis=0)[:3], [0.01, 0.01, 0.02], rtol=0.12)
