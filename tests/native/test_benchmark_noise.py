"""A build whose controllers sample with the benchmark's noise: what their ports draw."""

from __future__ import annotations

import numpy as np
import pytest
from controller_scenes import observe

from drake_navbench.commands.main import main
from drake_navbench.controllers.external import ExternalController
from drake_navbench.controllers.mppi.lanes import unpack
from drake_navbench.controllers.mppi.noise import Noise
from drake_navbench.inputs.robot import load_robot
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.noise import NoiseKey
from drake_navbench.native.build import build_checkout
from drake_navbench.native.builds import NoiseSource, find_build
from drake_navbench.trial.column_controller import controller_setup

KEY = NoiseKey(seed=5, stream=4, step=17)
SAMPLES, STEPS = 70, 3
PLAN = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
FREE = Costmap(np.zeros((60, 60), np.uint8), -1.5, -1.5, 0.05)
OBSERVATION = observe(PLAN, time_s=0.25, costmap=FREE, global_plan=PLAN, noise_key=KEY)


@pytest.fixture
def commanded(sampling):
    """A function that returns what such a controller commands in a build's first cycle."""

    def command(noise: NoiseSource, **values) -> np.ndarray:
        build = build_checkout(
            sampling, name="sampling", wanted=["nav2_mppi_controller"], noise=noise
        )
        client = {"plugin": "sampling::Controller", "parameters": values}
        parameters = ExternalController.Parameters(command=[str(build.host)], client=client)
        controller = ExternalController(parameters, controller_setup(load_robot("wheelchair")))
        try:
            return controller.step(OBSERVATION, controller.initial_memory()).command
        finally:
            controller.close()

    return command


def _drawn(*words: int, holonomic: bool = False) -> list[np.ndarray]:
    """Returns the port's noise of vx, vy and wz by the words of a key, each (samples, steps)."""
    noise = Noise.empty(SAMPLES, STEPS, holonomic=holonomic)
    noise.draw((KEY.seed, KEY.stream, *words), (0.2, 0.3, 0.4))
    return [unpack(axis, SAMPLES) for axis in noise]


@pytest.mark.long
def test_by_default_a_build_samples_with_noise_of_its_own(commanded):
    assert commanded(NoiseSource.OWN).tolist() == [0.5, 0.5, 0.5]


@pytest.mark.parametrize(("sample", "passes"), [(0, 0), (69, 0), (3, 2)])
def test_noise_of_each_pass_is_that_of_the_port(commanded, sample, passes):
    vx, _, wz = _drawn(1, KEY.step, passes)
    command = commanded(NoiseSource.BENCHMARK, sample=sample, passes=passes)
    assert command.tolist() == [vx[sample, 2], wz[sample, 2]]


@pytest.mark.parametrize(("pauses", "resets"), [(0, 0), (0, 2), (1, 0)])
def test_noise_that_is_kept_changes_with_each_reset_after_the_first_draw_of_the_task(
    commanded, pauses, resets
):
    # MPPI of Humble resets itself before the first draw, if a pause came before the task.
    vx, _, wz = _drawn(0, resets)
    command = commanded(
        NoiseSource.BENCHMARK, regenerate_noises=False, pauses=pauses, resets=resets
    )
    assert command.tolist() == [vx[0, 2], wz[0, 2]]


def test_what_moves_sideways_has_noise_there(commanded):
    vx, vy, wz = _drawn(1, KEY.step, 0, holonomic=True)
    command = commanded(NoiseSource.BENCHMARK, is_holonomic=True)
    assert command.tolist() == [vx[0, 2], wz[0, 2], vy[0, 2]]


def test_the_command_builds_it_and_says_so(sampling, capsys):
    assert main(["nav2-build", str(sampling), "--as", "both", "--noise", "benchmark"]) == 0
    assert "with the benchmark's noise" in capsys.readouterr().out
    assert find_build("both").noise is NoiseSource.BENCHMARK


def test_where_nothing_draws_noise_it_cannot_be_the_benchmarks(tiny, copied, capsys):
    assert main(["nav2-build", str(copied), "--noise", "benchmark"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "expected a build of nav2_mppi_controller" in error


def test_a_generator_in_another_place_is_one_line(sampling, capsys):
    folder = sampling / "nav2_mppi_controller" / "src"
    (folder / "noise_generator.cpp").rename(folder / "noise.cpp")
    assert main(["nav2-build", str(sampling), "--noise", "benchmark"]) == 2
    assert "src/noise_generator.cpp: no such file" in capsys.readouterr().err
