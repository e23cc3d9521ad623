"""The base that is fitted to a recording of the robot, in the probes."""

from __future__ import annotations

from drake_navbench.inputs.robot import load_robot
from drake_navbench.ros2.recordings.drive_fit import AxisFit, DriveFit
from drake_navbench.studies.doctor.bag import overrides_of
from drake_navbench.studies.doctor.probes import ROUGH, probes_for
from drake_navbench.studies.doctor.surroundings import Surroundings

FIT = DriveFit(0.312, 0.08, AxisFit(0.4567, 0.05, 0.01, 0.01), AxisFit(None, None, 0.01, 0.1))


def test_a_fitted_base_is_laid_over_every_probe():
    overrides = overrides_of(FIT)
    assert overrides == {
        "drive": {"response_time_constant_s": 0.312, "max_linear_acceleration_mps2": 0.457},
        "timing": {"command_latency_s": 0.08},
        "actuators": {"deadband_mps": 0.05},
    }
    robot = load_robot("wheelchair")
    probes = probes_for(robot, 0.5, Surroundings(overrides=overrides))
    for name, probe in probes.items():
        found = probe.robot_overrides
        assert found["drive"] == overrides["drive"]
        assert found["localization"]
        # What was measured counts more than what a rough probe assumes.
        assert found["timing"]["command_latency_s"] == 0.08
        assert ("odometry_latency_s" in found["timing"]) == (name.removesuffix("_rough") != name)
    assert len(ROUGH) == sum(name.endswith("_rough") for name in probes)
