"""The suite of a leaderboard: what is sealed is what is revealed, and nothing else is."""

from __future__ import annotations

import stat

import pytest
import yaml

from drake_navbench.analysis.leaderboard.suite import (
    MAX_SEED,
    Secret,
    Suite,
    read_open_suite,
    read_suite,
    reveal,
    seal,
)
from drake_navbench.errors import InputError

TEXT = """\
# What everybody drives.
name: indoor
version: 3
scenarios: [empty, doorway]
trials: 4
robot: wheelchair
"""


@pytest.fixture
def suite_path(tmp_path):
    path = tmp_path / "suite.yaml"
    path.write_text(TEXT)
    return path


@pytest.fixture
def secret_path(tmp_path):
    return tmp_path / "kept" / "secret.yaml"


def changed(path, **fields):
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | fields))


def one_line_of(call, *arguments, **options):
    with pytest.raises(InputError) as refused:
        call(*arguments, **options)
    assert "\n" not in str(refused.value)
    return str(refused.value)


def test_sealing_publishes_the_hash_and_keeps_the_seeds(suite_path, secret_path):
    sealed = seal(suite_path, secret_path, count=3)
    secret = yaml.safe_load(secret_path.read_text())
    published = suite_path.read_text()
    assert published.startswith(TEXT)
    assert sealed.sha256 in published
    assert secret["salt"] not in published
    assert not any(str(seed) in published for seed in secret["seeds"])
    assert len(set(secret["seeds"])) == 3
    assert all(0 <= seed <= MAX_SEED for seed in secret["seeds"])
    assert stat.S_IMODE(secret_path.stat().st_mode) == 0o600
    assert read_suite(suite_path).known_seeds == ()


def test_what_was_sealed_is_revealed_and_can_be_checked_by_all(suite_path, secret_path):
    seal(suite_path, secret_path, count=2)
    before = read_suite(suite_path)
    opened = reveal(suite_path, secret_path)
    assert opened.known_seeds == tuple(yaml.safe_load(secret_path.read_text())["seeds"])
    secret_path.unlink()
    assert reveal(suite_path, None) == read_open_suite(suite_path) == opened
    assert opened.digest == before.digest


def test_a_changed_seed_is_found(suite_path, secret_path):
    seal(suite_path, secret_path, count=2)
    seeds = yaml.safe_load(secret_path.read_text())["seeds"]
    original = secret_path.read_text()
    changed(secret_path, seeds=[seeds[0] ^ 1, seeds[1]])
    published = suite_path.read_text()
    assert "another SHA-256" in one_line_of(reveal, suite_path, secret_path)
    assert suite_path.read_text() == published
    secret_path.write_text(original)
    reveal(suite_path, secret_path)
    revealed = yaml.safe_load(suite_path.read_text())["revealed"]
    changed(suite_path, revealed=revealed | {"seeds": seeds[::-1]})
    assert "another SHA-256" in one_line_of(read_suite, suite_path)


def test_a_changed_salt_or_version_is_found(suite_path, secret_path):
    seal(suite_path, secret_path, count=1)
    secret = yaml.safe_load(secret_path.read_text())
    changed(suite_path, version=4)
    assert "version 4" in one_line_of(reveal, suite_path, secret_path)
    changed(suite_path, version=3)
    changed(secret_path, salt=secret["salt"][::-1])
    assert "another SHA-256" in one_line_of(reveal, suite_path, secret_path)


def test_the_salt_hides_equal_seeds():
    suite = Suite(name="a", version=1, scenarios=("empty",), trials=1, robot="wheelchair")
    hashes = {suite.hash_of(Secret(salt=salt * 64, seeds=(7,))) for salt in "ab"}
    assert len(hashes) == 2


def test_the_secret_does_not_go_into_the_repository_of_the_suite(suite_path, tmp_path):
    (tmp_path / ".git").mkdir()
    inside = tmp_path / "deep" / "secret.yaml"
    assert "in the repository" in one_line_of(seal, suite_path, inside, count=1)
    assert not inside.exists()
    assert suite_path.read_text() == TEXT


def test_nothing_is_sealed_twice_or_over_another_secret(suite_path, secret_path, tmp_path):
    secret_path.parent.mkdir()
    secret_path.write_text("of another suite")
    assert "exists already" in one_line_of(seal, suite_path, secret_path, count=1)
    assert secret_path.read_text() == "of another suite"
    seal(suite_path, tmp_path / "own.yaml", count=1)
    assert "already" in one_line_of(seal, suite_path, tmp_path / "more.yaml", count=1)


def test_a_file_that_cannot_be_added_to_is_left_alone(suite_path, secret_path):
    text = "{name: a, version: 1, scenarios: [empty], trials: 1, robot: wheelchair}\n"
    suite_path.write_text(text)
    assert "no field can be added" in one_line_of(seal, suite_path, secret_path, count=1)
    assert suite_path.read_text() == text
    assert not secret_path.exists()


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"seeds": [1, 1]}, "expected each once"),
        ({"seeds": [-1]}, "from 0 to"),
        ({"version": 0}, "version"),
        ({"trial": 4}, "did you mean 'trials'"),
        ({"seeds": [1], "sealed": {"sha256": "0" * 64, "count": 1}}, "beside sealed"),
        ({"revealed": {"salt": "0" * 64, "seeds": [1]}}, "nothing was sealed"),
    ],
)
def test_a_wrong_suite_is_one_line(suite_path, fields, told):
    changed(suite_path, **fields)
    assert told in one_line_of(read_suite, suite_path)


def test_a_suite_without_known_seeds_is_not_driven(suite_path, secret_path):
    assert "expected some" in one_line_of(read_open_suite, suite_path)
    seal(suite_path, secret_path, count=1)
    assert "reveal them first" in one_line_of(read_open_suite, suite_path)
