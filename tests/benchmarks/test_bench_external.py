"""What asking a program in another process costs: a cycle of the C++ example, 60 x 60 cells."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from controller_scenes import observe, setup_of

from drake_navbench.controllers.external import ExternalController
from drake_navbench.kernels.grid import Costmap

SOURCE = Path(__file__).parents[2] / "examples" / "external_controllers" / "carrot_client.cpp"
COMPILER = shutil.which("c++")


@pytest.mark.skipif(COMPILER is None, reason="there is no C++ compiler")
def test_bench_external_cycle(benchmark, tmp_path):
    program = tmp_path / "carrot_client"
    subprocess.run([COMPILER, "-std=c++17", "-O2", "-o", program, SOURCE], check=True)
    setup = setup_of(np.array([[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]))
    controller = ExternalController(ExternalController.Parameters(command=str(program)), setup)
    plan = np.column_stack([np.arange(0.0, 1.5, 0.05), np.zeros((30, 2))])
    costmap = Costmap(np.zeros((60, 60), np.uint8), -1.5, -1.5, 0.05)
    observation = observe(
        plan, pose=(0.0, 0.1, 0.1), twist=(0.3, 0.0), costmap=costmap, global_plan=plan
    )
    memory = controller.initial_memory()
    decision = benchmark(controller.step, observation, memory)
    controller.close()
    assert decision.command[0] > 0.0
