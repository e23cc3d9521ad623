"""Nobody but its owner reaches a cluster, unless the owner says that the network is trusted."""

from __future__ import annotations

import os
import socket
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest
from distributed import Client, LocalCluster
from distributed.security import Security

from drake_navbench.campaign import cluster_connection
from drake_navbench.campaign.cluster_connection import ClusterPlace, connected, require_cluster
from drake_navbench.commands import run as command
from drake_navbench.errors import InputError


def is_let_in(address: str, security: Security | None) -> bool:
    """Whether a stranger with these credentials can have a scheduler run code."""
    try:
        with Client(address, timeout=1.0, set_as_default=False, security=security) as stranger:
            return isinstance(stranger.run_on_scheduler(os.getpid), int)
    except (OSError, RuntimeError, ValueError, TypeError):
        return False


def test_strangers_on_this_machine_are_not_let_into_a_local_cluster(capfd):
    with connected(ClusterPlace("local:1")) as client:
        scheduler = client.scheduler.address
        (worker,) = client.scheduler_info()["workers"].values()
        assert client.submit(os.getpid).result() > 0
        assert client.run_on_scheduler(os.getpid) == os.getpid()
        for address in (scheduler, worker["nanny"]):
            assert address.startswith("tls://127.0.0.1:")
            assert not is_let_in(address.replace("tls:", "tcp:"), None)
            assert not is_let_in(address, Security.temporary())
        folder = Path(worker["local_directory"])
        owned = [place for place in (folder, *folder.parents) if place.name.startswith("drake_")]
        assert [stat.S_IMODE(place.stat().st_mode) for place in owned] == [0o700]
    assert not folder.exists()
    assert "Traceback" not in "".join(capfd.readouterr())


@pytest.fixture(scope="module")
def certificates(tmp_path_factory) -> Path:
    """A folder with one certificate for everybody, as docs/campaigns.md makes it."""
    folder = tmp_path_factory.mktemp("certificates")
    made = Security.temporary()
    for name, text in {
        "ca.pem": made.tls_ca_file,
        "cert.pem": made.tls_client_cert,
        "key.pem": made.tls_client_key,
    }.items():
        (folder / name).write_text(text)
        (folder / name).chmod(0o600)
    return folder


def security_of(folder: Path) -> Security:
    files = {"cert": str(folder / "cert.pem"), "key": str(folder / "key.pem")}
    roles = ("client", "scheduler", "worker")
    own = {f"tls_{role}_{what}": path for role in roles for what, path in files.items()}
    return Security(require_encryption=True, tls_ca_file=str(folder / "ca.pem"), **own)


@pytest.fixture(scope="module")
def scheduler(certificates) -> Iterator[str]:
    """The address of a scheduler that knows these certificates, and has no workers."""
    with LocalCluster(
        n_workers=0,
        dashboard_address=None,
        protocol="tls://",
        security=security_of(certificates),
    ) as cluster:
        yield cluster.scheduler_address


def test_a_scheduler_with_certificates_is_reached_with_them_alone(scheduler, certificates):
    with connected(ClusterPlace(scheduler, certificates)) as client:
        assert client.run_on_scheduler(os.getpid) == os.getpid()
    assert not is_let_in(scheduler, Security.temporary())


def test_a_scheduler_that_has_other_certificates_is_not_talked_to(
    scheduler, certificates, tmp_path, monkeypatch
):
    monkeypatch.setattr("drake_navbench.campaign.cluster_connection.CONNECT_TIMEOUT_S", 1.0)
    made = Security.temporary()
    for name, text in (("cert.pem", made.tls_client_cert), ("key.pem", made.tls_client_key)):
        (tmp_path / name).write_text(text)
    (tmp_path / "ca.pem").write_text(made.tls_ca_file)
    (tmp_path / "key.pem").chmod(0o600)
    with pytest.raises(InputError, match="or it has other certificates"):
        require_cluster(ClusterPlace(scheduler, tmp_path))


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda folder: (folder / "key.pem").unlink(), "No such file"),
        (lambda folder: (folder / "cert.pem").write_text("none"), "as PEM"),
        (lambda folder: (folder / "key.pem").write_text(OTHER_KEY), "of one another"),
        (lambda folder: (folder / "key.pem").chmod(0o644), "others may read it; expected mode 600"),
    ],
)
def test_certificates_that_cannot_be_used_are_a_line(spoil, told, certificates, tmp_path, capsys):
    for path in certificates.iterdir():
        (tmp_path / path.name).write_text(path.read_text())
        (tmp_path / path.name).chmod(0o600)
    spoil(tmp_path)
    asked = ["--cluster", "tls://127.0.0.1:8786", "--cluster-tls", str(tmp_path)]
    assert (
        command.main(["empty", "--controllers", "rpp", *asked, "--out", str(tmp_path / "o")]) == 2
    )
    error = capsys.readouterr().err
    assert error.startswith(f"--cluster-tls {tmp_path}")
    assert told in error
    assert error.count("\n") == 1


OTHER_KEY = Security.temporary().tls_client_key

ADDRESS_WANTED = "expected tls://HOST:PORT or tcp://HOST:PORT of a scheduler, or local:N"


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (["local:0"], "expected local:N with N from 1"),
        (["local:many"], "expected local:N with N from 1"),
        (["nowhere"], ADDRESS_WANTED),
        ([""], ADDRESS_WANTED),
        (["http://127.0.0.1:8786"], ADDRESS_WANTED),
        (["127.0.0.1:99999"], ADDRESS_WANTED),
        (["tcp://127.0.0.1:8786"], "runs code as you; expected tls://HOST:PORT with --cluster-tls"),
        (["127.0.0.1:8786"], "runs code as you; expected tls://HOST:PORT with --cluster-tls"),
        (["tls://127.0.0.1:8786"], "expected --cluster-tls DIR with ca.pem, cert.pem and key.pem"),
        (["tls://127.0.0.1:8786", "--trust-network"], "is encrypted; expected no --trust-network"),
        (["local:2", "--trust-network"], "makes its own certificates; expected no --trust-network"),
        (["tcp://127.0.0.1:8786", "--cluster-tls", "."], "expected tls:// with --cluster-tls"),
        (["tcp://127.0.0.1:{port}", "--trust-network"], "no scheduler answers there within 1 s"),
    ],
)
def test_a_cluster_that_cannot_be_had_is_one_line(asked, told, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(cluster_connection, "CONNECT_TIMEOUT_S", 1.0)
    with socket.socket() as taken:
        # Bound and never listening: nobody else gets the port, and nobody answers.
        taken.bind(("127.0.0.1", 0))
        asked = [word.format(port=taken.getsockname()[1]) for word in asked]
        out = tmp_path / "out"
        arguments = ["empty", "--controllers", "rpp", "--out", str(out)]
        status = command.main([*arguments, "--cluster", *asked])
    assert status == 2
    error = capsys.readouterr().err
    assert error.startswith(f"--cluster {asked[0]}: ")
    assert told in error
    assert error.count("\n") == 1
    assert not out.exists()


def test_words_on_a_cluster_without_one_are_refused(capsys):
    assert command.main(["empty", "--controllers", "rpp", "--trust-network"]) == 2
    assert capsys.readouterr().err == "--trust-network: expected --cluster as well\n"
