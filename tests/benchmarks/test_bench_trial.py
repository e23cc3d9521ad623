"""How much faster than real time a whole trial runs, on one core, once warm."""

import pytest

from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate


@pytest.mark.parametrize("preset", ["rpp", "dwb", "teb", "mppi", "mppi_nav2"])
def test_bench_static_obstacles(benchmark, preset):
    scenario = load_scenario("static_obstacles")
    spec = TrialSpec(scenario, load_robot("wheelchair"), load_preset(preset), seed=1)
    log = benchmark.pedantic(simulate, args=[spec], rounds=5, warmup_rounds=1)
    benchmark.extra_info["times_faster_than_real_time"] = round(
        log.end_time_s / benchmark.stats.stats.median, 1
    )


@pytest.mark.parametrize("robot", ["wheelchair", "wheelchair_casters", "wheelchair_multibody"])
def test_bench_physics(benchmark, robot):
    scenario = load_scenario("static_obstacles")
    spec = TrialSpec(scenario, load_robot(robot), load_preset("rpp"), seed=1)
    log = benchmark.pedantic(simulate, args=[spec], rounds=5, warmup_rounds=1)
    benchmark.extra_info["times_faster_than_real_time"] = round(
        log.end_time_s / benchmark.stats.stats.median, 1
    )
