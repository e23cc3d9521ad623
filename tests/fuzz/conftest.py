"""What the fuzz targets share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Callable[[str, bytes | str], Path]:
    """A function that writes a file of a name and returns its path."""
    folder = tmp_path_factory.mktemp("fuzz")

    def write(name: str, content: bytes | str) -> Path:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, str):
            content = content.encode(errors="surrogatepass")
        path.write_bytes(content)
        return path

    return write
