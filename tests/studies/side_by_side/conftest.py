"""What tests of ports beside originals share."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from drake_navbench.native.builds import Build


@pytest.fixture
def build_of() -> Callable[..., Build]:
    """A function that returns a build that was never made, with some of its fields."""

    def build(name: str = "mine", host: str = "/host") -> Build:
        return Build(
            name=name,
            host=host,
            release="jazzy",
            version="1.3.7",
            commit="abc",
            checkout="/nowhere",
            compiler="c++ 12",
            controllers=(),
            left_out={},
            seconds=1.0,
        )

    return build
