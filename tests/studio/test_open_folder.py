"""Nothing outside a studio's folder is read or written, and nothing is overwritten unseen."""

from __future__ import annotations

import pytest

from drake_navbench.errors import InputError
from drake_navbench.studio.open_folder import ChangedOnDisk, OpenFolder


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "secret.yaml").write_text("goal: [1, 0, 0]\n")
    (tmp_path / "mine" / "a.yaml").write_text("goal: [1, 0, 0]\n")
    (tmp_path / "mine" / "link.yaml").symlink_to(tmp_path / "secret.yaml")
    (tmp_path / "mine" / "way_out").symlink_to(tmp_path)
    return OpenFolder.at(tmp_path / "mine")


@pytest.mark.parametrize(
    "name", ["../secret.yaml", "link.yaml", "way_out/secret.yaml", "/etc/passwd", "", ".", "a\0b"]
)
def test_a_name_that_leads_outside_is_refused(folder, name):
    for use in (folder.read, folder.inside, lambda name: folder.write(name, "x", "")):
        with pytest.raises(InputError, match=r"lies outside|no name of a file"):
            use(name)


def test_links_that_lead_outside_are_not_listed(folder):
    assert folder.names((".yaml",)) == ["a.yaml"]


@pytest.mark.parametrize(
    "content",
    [
        {"world": {"map": "../secret.yaml"}},
        {"world": {"people": {"recording": {"file": "link.yaml"}}}},
        {"filters": [{"mask": "/etc/passwd"}]},
    ],
)
def test_a_file_may_not_name_another_one_outside(folder, content):
    with pytest.raises(InputError, match="the studio reads nothing there"):
        folder.require_inside(content, folder.root)


def test_a_file_may_name_what_is_inside_or_nowhere(folder):
    folder.require_inside({"map": "a.yaml", "description": "../nothing.yaml"}, folder.root)


def test_a_file_that_has_changed_on_disk_is_not_overwritten(folder):
    read = folder.read("a.yaml")
    (folder.root / "a.yaml").write_text("goal: [9, 0, 0]\n")
    with pytest.raises(ChangedOnDisk, match=r"a\.yaml: has changed on disk since it was opened"):
        folder.write("a.yaml", "goal: [2, 0, 0]\n", read.stamp)
    with pytest.raises(ChangedOnDisk, match=r"a\.yaml: exists already"):
        folder.write("a.yaml", "goal: [2, 0, 0]\n", "")
    assert folder.read("a.yaml").text == "goal: [9, 0, 0]\n"
    stamp = folder.write("a.yaml", "goal: [2, 0, 0]\n", folder.read("a.yaml").stamp)
    assert not folder.is_changed("a.yaml", stamp)


def test_a_second_studio_on_a_folder_is_refused_with_the_first_ones_address(folder):
    with folder.lock("process 7, http://127.0.0.1:5006"):
        with (
            pytest.raises(InputError, match=r"process 7, http://127.0.0.1:5006\); close that one"),
            folder.lock("second"),
        ):
            pass
        assert folder.names((".yaml",)) == ["a.yaml"]
    with folder.lock("third"):
        pass
