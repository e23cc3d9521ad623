"""What the tests of the doctor share."""

from __future__ import annotations

import pytest
from doctor_texts import MPPI, MPPI_BLOCK, nav2_text
from nav2_setups import read_nav2_files

from drake_navbench.inputs.robot import load_robot
from drake_navbench.studies.doctor.facts import facts_of
from drake_navbench.studies.doctor.files import Patient


@pytest.fixture
def patient(tmp_path):
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text(MPPI_BLOCK, plugin=MPPI))
    return Patient((path,), "wheelchair", {}, "jazzy")


@pytest.fixture
def facts(tmp_path):
    """A function that returns the facts of a Nav2 file's text for a robot."""

    def of(text, release="jazzy", robot="wheelchair"):
        path = tmp_path / "nav2.yaml"
        path.write_text(text)
        setup = read_nav2_files([path], load_robot(robot), robot, release=release)
        return facts_of(setup, setup.presets[0])

    return of
