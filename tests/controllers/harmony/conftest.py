import importlib
import sys
from pathlib import Path

import pytest
from harmony_scenes import problem


@pytest.fixture(scope="session")
def limits():
    return problem()[0].limits


@pytest.fixture(scope="session")
def study():
    """Imports a module of studies/ by its name."""
    folder = str(Path(__file__).parents[3] / "studies")

    def imported(name):
        sys.path.insert(0, folder)
        module = importlib.import_module(name)
        sys.path.remove(folder)
        return module

    return imported
