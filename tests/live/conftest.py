"""A domain of its own for each test of a running stack."""

from __future__ import annotations

import fcntl
import os
import random
import tempfile
from pathlib import Path

import pytest

# Domains from here on have ports that no other program is given by chance.
FIRST_DOMAIN, DOMAIN_COUNT = 20, 80


@pytest.fixture
def domain():
    """A domain that no other test of this machine uses at the same time."""
    numbers = list(range(FIRST_DOMAIN, FIRST_DOMAIN + DOMAIN_COUNT))
    random.Random(os.urandom(8)).shuffle(numbers)
    for number in numbers:
        path = Path(tempfile.gettempdir()) / f"drake_navbench-test-domain-{os.getuid()}-{number}"
        with path.open("w") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            yield number
            return
    pytest.fail("every domain is taken by another test")
