"""A domain of its own for each test of a running stack."""

from __future__ import annotations

import fcntl
import os
import random
import time
from pathlib import Path

import pytest

# Domains from here on have ports that no other program is given by chance.
FIRST_DOMAIN, DOMAIN_COUNT = 20, 80
# Not the temporary folder of the tests: each of their processes has its own.
LOCKS = Path("/tmp")
# The others in a domain know a stack that was killed for so long.
REMEMBERED_S = 20.0


@pytest.fixture
def domain():
    """A domain that no other test of this machine uses, or has just used."""
    numbers = list(range(FIRST_DOMAIN, FIRST_DOMAIN + DOMAIN_COUNT))
    random.Random(os.urandom(8)).shuffle(numbers)
    for number in numbers:
        path = LOCKS / f"drake_navbench-test-domain-{os.getuid()}-{number}"
        with path.open("a+") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            file.seek(0)
            if time.time() - float(file.read() or 0.0) < REMEMBERED_S:
                continue
            yield number
            file.truncate(0)
            file.write(str(time.time()))
            return
    pytest.fail("every domain is taken by another test")
