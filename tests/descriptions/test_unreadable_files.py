"""Files of a repository that cannot be read, and what stands in its place: told with what to do."""

from __future__ import annotations

import pytest
from descriptions_scenes import write_repository

from drake_navbench.commands.run import main
from drake_navbench.commands.show import main as show
from drake_navbench.inputs.package_search import find_package_files

LFS = "a pointer of Git LFS, not the file; run git lfs pull"
POINTER = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (POINTER.encode(), LFS),
        ("a: 1".encode("utf-16"), "not UTF-8 text, found UTF-16; save it as UTF-8"),
        (None, "a link to gone.yaml, which is not there"),
    ],
)
def test_a_file_that_cannot_be_read_is_told_with_what_to_do(tmp_path, capsys, content, reason):
    write_repository(tmp_path)
    file = tmp_path / "nav2_params.yaml"
    if content is None:
        file.symlink_to("gone.yaml")
    else:
        file.write_bytes(content)
    found = find_package_files([tmp_path])
    assert found.lines(found.picked([]))[-1] == f"not read: nav2_params.yaml: {reason}"
    # Where it leaves no robot, the error tells it, too.
    (tmp_path / "robots").mkdir()
    file.rename(tmp_path / "robots" / "cart.urdf")
    assert main(["--package", str(tmp_path / "robots"), "--check"]) == 2
    assert capsys.readouterr().err.endswith(f"; not read: cart.urdf: {reason}\n")


def test_the_picture_of_a_map_that_git_lfs_keeps_elsewhere_makes_no_map(tmp_path):
    write_repository(tmp_path)
    (tmp_path / "map.yaml").write_text("image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    (tmp_path / "map.pgm").write_text(POINTER)
    found = find_package_files([tmp_path])
    told = found.lines(found.picked([]))
    assert told[-1] == f"not read: map.pgm: {LFS}"
    assert "map: none found; the picture that map.yaml names is not there, perhaps by upper" in str(
        told
    )


@pytest.mark.parametrize(
    ("root", "reason"),
    [
        ("cart.zip", "is an archive; expected the folder of a robot's packages: unpack it"),
        ("https://host/cart", "expected the folder of a robot's packages; clone the repository"),
        ("gone", "expected the folder of a robot's packages"),
    ],
)
def test_what_is_no_folder_of_packages_is_one_line_that_tells_what_to_do(
    tmp_path, monkeypatch, capsys, root, reason
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cart.zip").write_bytes(b"PK\x03\x04")
    assert main(["--package", root]) == 2
    said = capsys.readouterr().err
    assert reason in said
    assert said.count("\n") == 1
    (tmp_path / "nav.zip").write_bytes(b"PK\x03\x04\x9c")
    assert main(["--nav2", "nav.zip", "--check"]) == 2
    assert "nav.zip: is an archive; expected a file in it, unpacked" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["room.sdf", "room.world", "cart.urdf"])
def test_a_world_or_robot_in_utf_16_is_told_as_such(tmp_path, capsys, name):
    file = tmp_path / name
    file.write_bytes('<sdf><world name="room"/></sdf>'.encode("utf-16"))
    asked = ["--robot", str(file)] if name == "cart.urdf" else [str(file), "--goals", "2"]
    assert show([*asked, "--out", str(tmp_path / "plan.png")]) == 2
    told = f"{file}: not UTF-8 text, found UTF-16; save it as UTF-8\n"
    assert capsys.readouterr().err.endswith(told)
