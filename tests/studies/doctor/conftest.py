"""What the tests of the doctor share."""

from __future__ import annotations

import pytest
from doctor_texts import MPPI, MPPI_BLOCK, nav2_text

from drake_navbench.studies.doctor.files import Patient


@pytest.fixture
def patient(tmp_path):
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text(MPPI_BLOCK, plugin=MPPI))
    return Patient((path,), "wheelchair", {}, "jazzy")
