"""The package in examples/ that users start from is one, and its own tests hold."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from drake_navbench.inputs.foreign_code import runs_foreign_code
from drake_navbench.inputs.presets import load_preset

TEMPLATE = Path(__file__).parents[1] / "examples" / "controller_package"


def test_the_template_of_a_package_is_a_column_when_it_is_installed(install_folder):
    install_folder(TEMPLATE)
    preset = load_preset("my_controller:lookahead=0.5")
    assert (preset.parameters.speed, preset.parameters.lookahead) == (0.45, 0.5)
    assert runs_foreign_code(preset)


OPTIONS = ["-q", "-o", "addopts=", "-p", "no:cacheprovider", str(TEMPLATE / "tests")]


def test_the_tests_of_the_template_pass_but_for_its_trial(install_folder, capfd):
    install_folder(TEMPLATE)
    assert pytest.main([*OPTIONS, "-k", "not drives"]) == 0
    assert "7 passed, 1 deselected" in capfd.readouterr().out


@pytest.mark.long
def test_all_tests_of_the_template_pass(install_folder, tmp_path):
    installed = install_folder(TEMPLATE)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *OPTIONS],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(installed), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "8 passed" in done.stdout
