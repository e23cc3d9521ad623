"""The lock file and the audit of it: exact, complete, and never a pass without an answer."""

import json
import re
import runpy
import tomllib
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
LOCK = (REPOSITORY / "requirements.lock").read_text(encoding="utf-8")
judge = runpy.run_path(str(REPOSITORY / ".ci" / "audit.py"))["judge"]


def plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def locked_entries() -> list[str]:
    return [entry.replace("\\\n", " ") for entry in re.split(r"\n(?=\S)", LOCK.strip())]


def test_every_entry_is_one_version_with_hashes_and_no_address():
    for entry in locked_entries():
        assert re.match(r"[a-z0-9-]+==[0-9][^ ]* ", entry), entry
        assert "--hash=sha256:" in entry
    assert "://" not in LOCK
    assert "index" not in LOCK


def test_everything_that_is_required_is_locked():
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))
    extras = project["project"]["optional-dependencies"]
    with_own_environments = ("ros", "site")
    required = [
        *project["build-system"]["requires"],
        *project["project"]["dependencies"],
        *(
            requirement
            for name, own in extras.items()
            if name not in with_own_environments
            for requirement in own
        ),
    ]
    names = {plain(re.split(r"[<>=~ \[]", requirement)[0]) for requirement in required}
    names.discard(project["project"]["name"])
    assert names <= {entry.partition("==")[0] for entry in locked_entries()}


def report(*dependencies: dict) -> str:
    return json.dumps({"dependencies": list(dependencies), "fixes": []})


FINE = {"name": "numpy", "version": "2.0", "vulns": []}
KNOWN = {"name": "pillow", "version": "9.0", "vulns": [{"id": "PYSEC-1"}]}
SKIPPED = {"name": "drake", "skip_reason": "not found"}


@pytest.mark.parametrize(
    ("output", "lines", "status"),
    [
        (report(FINE), ["1 packages, no vulnerability known"], 0),
        (report(FINE, KNOWN), ["pillow 9.0: PYSEC-1"], 1),
        (report(FINE, SKIPPED), ["no advisory service answers for 1 of 2 packages"], 3),
        (
            report(KNOWN, SKIPPED),
            ["pillow 9.0: PYSEC-1", "no advisory service answers for 1 of 2 packages"],
            1,
        ),
        (report(), ["no advisory service answers for 0 of 0 packages"], 3),
        ("", ["no advisory service answers: nothing is known of any package"], 3),
        ("[]", ["no advisory service answers: nothing is known of any package"], 3),
    ],
)
def test_an_audit_without_an_answer_is_no_pass(output, lines, status):
    assert judge(output) == (lines, status)
