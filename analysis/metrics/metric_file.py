"""Metrics in files of their own, without a package: `--metric my.py:name`.

Workers find the files by an environment variable that is set when they start, so that every process
that measures a trial also computes these metrics.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from drake_navbench.analysis.metrics.definition import Metric
from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.plugins.python_file import module_of
from drake_navbench.typed_files.input_file import read_input

VARIABLE = "DRAKE_NAVBENCH_METRIC_FILES"
SEPARATOR = "\n"
MAX_FILE_BYTES = 2**20


def metric_in_file(reference: str) -> Metric:
    """Returns the metric of 'my.py:name', a function decorated with @metric; raises InputError."""
    path_text, colon, name = reference.rpartition(":")
    path = Path(path_text)
    if not colon or path.suffix != ".py" or not name.isidentifier():
        raise InputError(f"--metric {reference!r}: expected FILE.py:NAME")
    content = read_input(path, max_bytes=MAX_FILE_BYTES)
    digest = hashlib.sha256(content).hexdigest()
    module = module_of(path, content, digest, "metric_file", f"--metric {reference}")
    found = vars(module).get(name)
    if not isinstance(found, Metric):
        own = [key for key, value in vars(module).items() if isinstance(value, Metric)]
        raise InputError(
            f"--metric {reference}: no function {name!r} decorated with @metric"
            f"{nearest_name_hint(name, own)}"
        )
    return found


def asked_metrics() -> tuple[Metric, ...]:
    """Returns the metrics of the files in this process's environment variable."""
    return _metrics_of(os.environ.get(VARIABLE, ""))


@cache
def _metrics_of(references: str) -> tuple[Metric, ...]:
    return tuple(map(metric_in_file, filter(None, references.split(SEPARATOR))))


def remember(references: Sequence[str]) -> None:
    """Makes this process, and the workers that it starts, compute these metrics, too."""
    absolute = []
    for reference in references:
        path, colon, name = reference.rpartition(":")
        absolute.append(f"{Path(path).absolute()}{colon}{name}")
    os.environ[VARIABLE] = SEPARATOR.join(absolute)
