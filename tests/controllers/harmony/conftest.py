import pytest
from harmony_scenes import problem


@pytest.fixture(scope="session")
def limits():
    return problem()[0].limits
