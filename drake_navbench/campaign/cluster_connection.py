"""Connects to a cluster of dask.distributed, so that nobody else can.

Whoever reaches a scheduler or a worker of dask runs code as its owner, so each connection is
encrypted and wants a certificate on both sides, unless its user says that the network is trusted.
"""

from __future__ import annotations

import argparse
import logging
import re
import ssl
import stat
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from drake_navbench.errors import InputError

if TYPE_CHECKING:
    from distributed import Client
    from distributed.security import Security

LOCAL = "local:"
# Addresses of dask, always with a port. For any other text, dask would leave a client behind that
# cannot be closed.
ADDRESS = re.compile(r"((tcp|tls|ws|wss|ucx)://)?([^\s/:]+|\[[0-9a-fA-F:]+\]):([0-9]{1,5})")
ENCRYPTED = ("tls", "wss")
LAST_PORT = 65535
MOST_LOCAL_WORKERS = 256
CONNECT_TIMEOUT_S = 5.0
# This many processes may die with a chunk before the chunk is given up.
ALLOWED_FAILURES = 10
# Files in the folder of --cluster-tls: the trusted authority, our certificate, and its private key.
AUTHORITY, CERTIFICATE, KEY = "ca.pem", "cert.pem", "key.pem"
NOT_INSTALLED = "dask.distributed is not installed; pip install 'drake-navbench[cluster]'"


class ClusterPlace(NamedTuple):
    """The address of a cluster, and the reason to trust it.

    address: `local:N`, or an address of dask's scheduler. certificates: the folder with `ca.pem`,
    `cert.pem` and `key.pem` for `tls://`. trusts_network: whether an address without encryption is
    accepted.
    """

    address: str
    certificates: Path | None = None
    trusts_network: bool = False


def cluster_place(arguments: argparse.Namespace) -> ClusterPlace | None:
    """Returns the cluster that the options ask for; raises InputError where they disagree."""
    certificates, trusts = arguments.cluster_tls, arguments.trust_network
    if arguments.cluster is None:
        if certificates is not None or trusts:
            option = "--trust-network" if trusts else "--cluster-tls"
            raise InputError(f"{option}: expected --cluster as well")
        return None
    return ClusterPlace(arguments.cluster, certificates, trusts)


def require_cluster(place: ClusterPlace) -> None:
    """Raises InputError where a campaign cannot be driven at a place."""
    _security_of(place)
    if not place.address.startswith(LOCAL):
        with connected(place):
            pass


@contextmanager
def connected(place: ClusterPlace) -> Iterator[Client]:
    """Yields a client of a scheduler, or of `local:N` workers that end with the block.

    Raises InputError where no scheduler answers, or dask.distributed is not installed.
    """
    security = _security_of(place)
    import dask
    from distributed import Client, LocalCluster

    logging.getLogger("distributed").setLevel(logging.ERROR)
    settings = {
        # Dask's processes start workers of their own.
        "distributed.worker.daemon": False,
        "distributed.scheduler.allowed-failures": ALLOWED_FAILURES,
    }
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(settings))
        scheduler: Any = place.address
        if place.address.startswith(LOCAL):
            # A worker imports and unpickles from its folder; dask's default is a folder in /tmp
            # that anybody may have made before.
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="drake_navbench-"))
            scheduler = stack.enter_context(
                LocalCluster(
                    n_workers=_local_count(place.address),
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=None,
                    silence_logs=logging.ERROR,
                    protocol="tls://",
                    security=security,
                    local_directory=folder,
                )
            )
        try:
            client = Client(
                scheduler, timeout=CONNECT_TIMEOUT_S, set_as_default=False, security=security
            )
        except (OSError, ValueError, TypeError) as error:
            other = "" if place.certificates is None else ", or it has other certificates"
            raise InputError(
                f"--cluster {place.address}: no scheduler answers there within "
                f"{CONNECT_TIMEOUT_S:g} s{other}; expected HOST:PORT of one, or local:N"
            ) from error
        yield stack.enter_context(client)


def _security_of(place: ClusterPlace) -> Security:
    """Returns dask's security settings: the certificates that both ends show and accept.

    Raises InputError where the address is wrong or does not fit the options beside it.
    """
    address, certificates = place.address, place.certificates
    if address.startswith(LOCAL):
        _local_count(address)
        if certificates is not None or place.trusts_network:
            option = "--cluster-tls" if certificates is not None else "--trust-network"
            raise InputError(
                f"--cluster {address}: makes its own certificates; expected no {option}"
            )
        return _security().temporary()
    found = ADDRESS.fullmatch(address)
    if found is None or not 1 <= int(found[4]) <= LAST_PORT:
        raise InputError(
            f"--cluster {address}: expected tls://HOST:PORT or tcp://HOST:PORT of a scheduler, "
            "or local:N"
        )
    if found[2] in ENCRYPTED:
        if place.trusts_network:
            raise InputError(f"--cluster {address}: is encrypted; expected no --trust-network")
        return _security_of_files(address, certificates)
    if certificates is not None:
        raise InputError(f"--cluster {address}: expected tls:// with --cluster-tls")
    if not place.trusts_network:
        raise InputError(
            f"--cluster {address}: without TLS, whoever reaches the scheduler or a worker runs "
            "code as you; expected tls://HOST:PORT with --cluster-tls DIR, or --trust-network"
        )
    return _security()(require_encryption=False)


def _security_of_files(address: str, folder: Path | None) -> Security:
    if folder is None:
        raise InputError(
            f"--cluster {address}: expected --cluster-tls DIR with {AUTHORITY}, {CERTIFICATE} "
            f"and {KEY}"
        )
    authority, certificate, key = (
        str(folder.absolute() / name) for name in (AUTHORITY, CERTIFICATE, KEY)
    )
    try:
        is_secret = not stat.S_IMODE(Path(key).stat().st_mode) & (stat.S_IRWXG | stat.S_IRWXO)
        context = ssl.create_default_context(cafile=authority)
        # A key with a password would ask for it at the terminal, in every process.
        context.load_cert_chain(certificate, key, password=lambda: "")
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else ""
        raise InputError(
            f"--cluster-tls {folder}: expected {AUTHORITY}, {CERTIFICATE} and {KEY} of one "
            f"another, as PEM and without a password: {reason or error}"
        ) from error
    if not is_secret:
        raise InputError(f"--cluster-tls {key}: others may read it; expected mode 600")
    return _security()(
        require_encryption=True,
        tls_ca_file=authority,
        tls_client_cert=certificate,
        tls_client_key=key,
    )


def _security() -> type[Security]:
    try:
        import cryptography  # noqa: F401  # which makes the temporary certificates
        from distributed.security import Security
    except ImportError as error:
        raise InputError(NOT_INSTALLED) from error
    return Security


def _local_count(address: str) -> int:
    text = address.removeprefix(LOCAL)
    count = int(text) if text.isdecimal() else 0
    if not 1 <= count <= MOST_LOCAL_WORKERS:
        raise InputError(
            f"--cluster {address}: expected local:N with N from 1 to {MOST_LOCAL_WORKERS}"
        )
    return count
