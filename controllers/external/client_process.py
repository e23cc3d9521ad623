"""A client: a process that answers messages over two pipes that nothing else uses.

Each message is its length, 4 bytes, most significant first, and that many bytes of MessagePack. Any
failure of a client is reported within the deadline, and its process is gone by then.
"""

from __future__ import annotations

import ctypes
import os
import select
import shutil
import signal
import struct
import subprocess
import sys
import time
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, NoReturn

import msgpack

from drake_navbench.errors import OUTSIDE_SIGNALS, EndedFromOutside, InputError, is_machine_fault

# The environment variable by which the client finds its ends of the pipes.
READ_VARIABLE = "DRAKE_NAVBENCH_READ_FD"
WRITE_VARIABLE = "DRAKE_NAVBENCH_WRITE_FD"
LENGTH = struct.Struct(">I")
MAX_ANSWER_BYTES = 2**24
CHUNK_BYTES = 2**16
# The last bytes of a client's output that are kept.
KEPT_OUTPUT_BYTES = 4096
# The time that a client has to end by itself, after `shutdown` or when it has closed its pipe.
EXIT_PATIENCE_S = 1.0
# While its pipe is full a client may wait for us to read its output.
ROOM_PATIENCE_S = 0.01
PR_SET_PDEATHSIG = 1
IS_LINUX = sys.platform == "linux"


class ExternalControllerFailed(RuntimeError):
    """The client died, did not answer in time, or gave an invalid answer."""


class ClientProcess:
    """One client from its start to its end.

    command: program and arguments. shows_output: whether its output goes to our terminal. Raises
    InputError where there is no such program.
    """

    def __init__(self, command: Sequence[str], *, shows_output: bool = False) -> None:
        program = shutil.which(command[0])
        if program is None:
            raise InputError(f"command: {command[0]!r}: no such program or not executable")
        self._name = os.path.basename(command[0])
        self._packer = msgpack.Packer(autoreset=True)
        self._answer = bytearray()
        self._asked = ""
        self._output = b""
        their_in, self._to_client = os.pipe()
        self._from_client, their_out = os.pipe()
        printed: tuple[int | None, int | None] = (None, None) if shows_output else os.pipe()
        self._printed, their_print = printed
        theirs = [their_in, their_out, *([their_print] if their_print is not None else [])]
        ours = [self._to_client, self._from_client]
        ours += [self._printed] if self._printed is not None else []
        places = {READ_VARIABLE: str(their_in), WRITE_VARIABLE: str(their_out)}
        try:
            self._process = subprocess.Popen(
                [program, *command[1:]],
                stdin=subprocess.DEVNULL,
                stdout=their_print,
                stderr=their_print,
                pass_fds=(their_in, their_out),
                env=os.environ | places,
                # Ctrl-C is for the benchmark to deal with.
                start_new_session=True,
                preexec_fn=_end_with_parent() if IS_LINUX else None,
            )
        except (OSError, ValueError) as error:
            for descriptor in ours:
                os.close(descriptor)
            if is_machine_fault(error):
                raise
            raise InputError(f"command: {command[0]!r}: cannot be started: {error}") from error
        finally:
            for descriptor in theirs:
                os.close(descriptor)
        for descriptor in ours:
            os.set_blocking(descriptor, False)
        self._poll = select.poll()
        for descriptor in ours[1:]:
            self._poll.register(descriptor, select.POLLIN)
        self._room = select.poll()
        self._room.register(self._to_client, select.POLLOUT)
        self._end = weakref.finalize(self, _end, self._process, ours)

    def ask(self, message: Mapping[str, Any], *, deadline_s: float) -> dict[str, Any]:
        """Returns the answer to a message.

        Raises ExternalControllerFailed, and ends the client, where no answer comes within the
        deadline; EndedFromOutside where a signal from outside has ended it.
        """
        if not self._end.alive:
            raise ExternalControllerFailed(f"{self._name}: was already ended")
        self._asked = str(message["call"])
        deadline = time.monotonic() + deadline_s
        body = self._packer.pack(message)
        self._send(LENGTH.pack(len(body)) + body, deadline)
        while not self._is_answered():
            left_s = deadline - time.monotonic()
            if left_s <= 0.0:
                self.fail(f"no answer to {message['call']} within {deadline_s:g} s")
            self._listen(left_s)
        answer = self._decoded(bytes(self._answer[LENGTH.size :]))
        self._answer.clear()
        return answer

    def stop(self) -> None:
        """Asks the client to shut down, and kills it if it does not."""
        if not self._end.alive:
            return
        body = self._packer.pack({"call": "shutdown"})
        with suppress(OSError):
            os.write(self._to_client, LENGTH.pack(len(body)) + body)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(EXIT_PATIENCE_S)
        self._end()

    def _send(self, frame: bytes, deadline: float) -> None:
        rest = memoryview(frame)
        while rest:
            try:
                rest = rest[os.write(self._to_client, rest) :]
            except BlockingIOError:
                # The pipe is full; the client may be printing, or answering too early, meanwhile.
                left_s = deadline - time.monotonic()
                if left_s <= 0.0:
                    self.fail("does not read its input within the deadline")
                self._room.poll(1000.0 * min(left_s, ROOM_PATIENCE_S))
                self._listen(0.0)
            except BrokenPipeError:
                self._fail_dead()

    def _is_answered(self) -> bool:
        """Returns whether the answer has come as a whole."""
        if len(self._answer) < LENGTH.size:
            return False
        (length,) = LENGTH.unpack_from(self._answer)
        if length > MAX_ANSWER_BYTES:
            self.fail(f"announced an answer of {length} bytes, expected at most {MAX_ANSWER_BYTES}")
        surplus = len(self._answer) - LENGTH.size - length
        if surplus > 0:
            self.fail(f"sent {surplus} bytes behind its answer")
        return surplus == 0

    def _listen(self, patience_s: float) -> None:
        """Reads what the client writes, waiting for at most `patience_s`."""
        for descriptor, _ in self._poll.poll(1000.0 * patience_s):
            try:
                piece = os.read(descriptor, CHUNK_BYTES)
            except BlockingIOError:
                continue
            if descriptor == self._from_client:
                if not piece:
                    self._fail_dead()
                self._answer += piece
            elif piece:
                self._output = (self._output + piece)[-KEPT_OUTPUT_BYTES:]
            else:
                self._poll.unregister(descriptor)

    def _decoded(self, body: bytes) -> dict[str, Any]:
        try:
            answer = msgpack.unpackb(body, strict_map_key=True)
        except (ValueError, RecursionError) as error:
            self.fail(f"its answer is not MessagePack: {error or type(error).__name__}")
        if not isinstance(answer, dict):
            self.fail(f"its answer is {type(answer).__name__}, expected a map")
        return answer

    def fail(self, what: str) -> NoReturn:
        """Ends a client with `what` as the reason; raises ExternalControllerFailed."""
        self._drain()
        self._end()
        raise ExternalControllerFailed(f"{self._name}: {what}{self._last_words()}")

    def _fail_dead(self) -> NoReturn:
        """Fails with the way the client died, or with the message that it closed its pipe."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(EXIT_PATIENCE_S)
        code = self._process.returncode
        if code is None:
            self.fail("closed its pipe")
        if code >= 0:
            self.fail(f"ended with exit code {code} before it answered {self._asked}")
        name = signal.strsignal(-code) or "unknown"
        how = f"was ended by signal {-code} ({name})"
        if -code in OUTSIDE_SIGNALS:
            self._drain()
            self._end()
            raise EndedFromOutside(f"{self._name}: {how}")
        self.fail(how)

    def _drain(self) -> None:
        """Reads the rest of the client's output."""
        while self._printed is not None:
            try:
                piece = os.read(self._printed, CHUNK_BYTES)
            except OSError:
                return
            if not piece:
                return
            self._output = (self._output + piece)[-KEPT_OUTPUT_BYTES:]

    def _last_words(self) -> str:
        """Returns the client's last words: one line for the reason, the kept rest below it."""
        text = self._output.decode(errors="replace").strip()
        return f"; it printed last: {text.splitlines()[-1]}\n{text}" if text else ""


def _end(process: subprocess.Popen[bytes], descriptors: Sequence[int]) -> None:
    """Kills a client with all processes it has started, and closes our ends of the pipes."""
    for descriptor in descriptors:
        os.close(descriptor)
    with suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _end_with_parent() -> Callable[[], None]:
    """Returns a function that makes a new process end when its parent is killed."""
    # A function called between fork and exec should load nothing.
    control = ctypes.CDLL(None).prctl

    def ask_the_kernel() -> None:
        control(PR_SET_PDEATHSIG, signal.SIGKILL)

    return ask_the_kernel
