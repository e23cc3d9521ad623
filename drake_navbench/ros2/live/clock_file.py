"""The lock that lets one process at a time drive in a DDS domain, and the last stamp of its clock.

A stack that lives through several trials must not see /clock jump back. The last stamp of a domain
is kept in a small file; the process that has locked the file drives in the domain.
"""

from __future__ import annotations

import fcntl
import time
from pathlib import Path
from typing import IO

from drake_navbench.errors import CannotBeWritten, InputError
from drake_navbench.processes.cache_folder import own_temporary_folder

# TF takes a stamp of 0 for "the latest".
FIRST_STAMP_NS = 10_000_000_000
# The time between two trials, so that no transform of one is taken for one of the next, ns.
GAP_NS = 2_000_000_000
FREE_PATIENCE_S = 5.0
# A killed process cannot write its last stamp, so each writes a stamp this far ahead, ns.
AHEAD_NS = 60_000_000_000


class ClockFile:
    """The lock and the last stamp of a domain; raises InputError where the lock is taken.

    first_stamp_ns: the stamp with which a trial begins.
    """

    def __init__(self, domain: int, folder: Path | None = None) -> None:
        try:
            path = (folder or Path(own_temporary_folder())) / f"live-domain-{domain}"
            self._file: IO[str] = path.open("a+", encoding="ascii")
        except OSError as error:
            raise CannotBeWritten(
                f"live: the clock of domain {domain} cannot be kept: {error}"
            ) from error
        self._lock(domain)
        self._file.seek(0)
        text = self._file.read().strip()
        last_ns = int(text) if text.isdecimal() else 0
        self.first_stamp_ns = max(FIRST_STAMP_NS, last_ns + GAP_NS)
        self._kept_ns = 0
        self.keep(self.first_stamp_ns)

    def keep(self, stamp_ns: int) -> None:
        """Notes that the clock has reached a stamp."""
        if stamp_ns >= self._kept_ns:
            self._write(stamp_ns + AHEAD_NS)

    def close(self, last_stamp_ns: int) -> None:
        """Writes the last stamp and releases the lock."""
        if not self._file.closed:
            self._write(last_stamp_ns)
            self._file.close()

    def _write(self, stamp_ns: int) -> None:
        self._kept_ns = stamp_ns
        self._file.seek(0)
        self._file.truncate()
        self._file.write(str(stamp_ns))
        self._file.flush()

    def _lock(self, domain: int) -> None:
        deadline = time.monotonic() + FREE_PATIENCE_S
        while True:
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                if time.monotonic() >= deadline:
                    self._file.close()
                    raise InputError(
                        f"live: domain {domain}: another drake_navbench drives there; expected a "
                        "free domain, such as domain=1 with ROS_DOMAIN_ID=1 for the stack"
                    ) from None
                time.sleep(0.1)
            else:
                return
