"""Shuts the sockets of a DDS domain to everything that comes from the network.

Cyclone DDS sends by the configured interface, but listens on all of them. Linux lets a socket be
bound to a device: then only what this machine sends itself arrives.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import suppress

from drake_navbench.errors import InputError

LOOPBACK_DEVICE = b"lo"
# DDSI's rule for ports: those of domain d begin at PORT_BASE + PORTS_OF_DOMAIN * d.
PORT_BASE, PORTS_OF_DOMAIN = 7400, 250


def bind_to_loopback(domain: int) -> None:
    """Binds this process's sockets of a domain to the loopback device.

    Raises InputError where there are none or the system does not allow it.
    """
    found = list(domain_sockets(domain))
    for one in found:
        try:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, LOOPBACK_DEVICE)
        except (AttributeError, OSError) as error:
            raise InputError(
                f"live: domain {domain}: its sockets cannot be closed to the network: {error}; "
                "expected Linux 5.7 or later, or peers"
            ) from error
        finally:
            one.close()
    if not found:
        raise InputError(f"live: domain {domain}: found no sockets to close to the network")


def domain_sockets(domain: int) -> Iterator[socket.socket]:
    """Yields copies of this process's UDP sockets on the ports of a domain; the caller closes them.

    Those of IPv4: Cyclone DDS opens no others unless it is configured to.
    """
    first = PORT_BASE + PORTS_OF_DOMAIN * domain
    for name in os.listdir("/proc/self/fd"):
        with suppress(OSError):
            if not os.readlink(f"/proc/self/fd/{name}").startswith("socket:"):
                continue
            one = socket.socket(fileno=os.dup(int(name)))
            if one.family == socket.AF_INET and one.type == socket.SOCK_DGRAM:
                port = one.getsockname()[1]
                if first <= port < first + PORTS_OF_DOMAIN:
                    yield one
                    continue
            one.close()
