"""Calls a function in a process of its own, with bounds on memory and time.

It is for reading files of others: a malicious file may make its reader use both without end.
Argument and result must be representable in JSON. The function is named `package.module:function`,
so that the process imports its module alone.
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

from drake_navbench.errors import InputError, NavbenchError, as_line, one_line

GIGABYTE = 2**30
MEMORY_LIMIT_BYTES = GIGABYTE
TIME_LIMIT_S = 30
# A busy computer gives a process less than a processor's time: so many times longer it may take.
WAITING = 5
# The last line that a child prints when its memory did not suffice.
OUT_OF_MEMORY = "out of memory"
# One thread: each thread of a numerical library reserves memory that counts against the limit.
ONE_THREAD = {name: "1" for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")}


def call_limited(
    function: str,
    argument: Any,
    source: str,
    *,
    folder: Path | None = None,
    memory_bytes: int = MEMORY_LIMIT_BYTES,
    time_s: int = TIME_LIMIT_S,
) -> Any:
    """Calls `package.module:function` with an argument in a new process; returns its result.

    source: the name of the file that the function reads, for errors. folder: the working folder of
    the process. time_s: processor time; the call itself may last `WAITING` times as long. Raises
    InputError, one line, where the function raises, or where it exceeds its memory or time.
    """
    try:
        answer = _answer_of_child(function, argument, folder, memory_bytes, time_s)
    except subprocess.TimeoutExpired as error:
        raise InputError(f"{source}: not read within {WAITING * time_s} s") from error
    if "fault" not in answer:
        return answer["value"]
    if answer["fault"] == OUT_OF_MEMORY:
        limit = f"{memory_bytes / GIGABYTE:g} GB of memory and {time_s} s"
        raise InputError(f"{source}: not read: expected a file that needs at most {limit}")
    raise InputError(f"{source}: {answer['fault']}")


def _answer_of_child(
    function: str, argument: Any, folder: Path | None, memory_bytes: int, time_s: int
) -> dict[str, Any]:
    """Returns a child's answer, `value` or `fault`; raises TimeoutExpired."""
    command = [sys.executable, "-m", __name__, function, str(memory_bytes), str(time_s)]
    # The child is to find the package in the same place as this process.
    paths = os.pathsep.join([str(Path(__file__).parents[2]), *filter(None, sys.path)])
    done = subprocess.run(
        command,
        input=json.dumps(argument).encode(),
        capture_output=True,
        cwd=folder,
        env={**os.environ, **ONE_THREAD, "PYTHONPATH": paths},
        timeout=WAITING * time_s,
        check=False,
    )
    try:
        answer: dict[str, Any] = json.loads(done.stdout)
    except ValueError:
        return {"fault": OUT_OF_MEMORY if done.returncode else "no answer"}
    return answer


def main(function: str, memory_bytes: int, time_s: int) -> None:
    """Calls the function in the child; the answer goes to stdout, all other output to stderr."""
    resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes))
    resource.setrlimit(resource.RLIMIT_CPU, (time_s, time_s))
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    out.write(_answer(function, sys.stdin.read()))
    out.flush()


def _answer(function: str, argument: str) -> str:
    module, _, name = function.partition(":")
    try:
        value = getattr(importlib.import_module(module), name)(json.loads(argument))
        return json.dumps({"value": value})
    except MemoryError:
        return json.dumps({"fault": OUT_OF_MEMORY})
    except NavbenchError as error:
        return json.dumps({"fault": as_line(str(error))})
    except Exception as error:
        return json.dumps({"fault": as_line(one_line(error))})


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
