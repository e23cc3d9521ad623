"""The gate from two checkouts to its exit status, with a controller of our own."""

from __future__ import annotations

from drake_navbench.__main__ import main
from drake_navbench.native.builds import find_build


def test_a_change_is_driven_and_told(tiny, copied, tmp_path, capsys):
    source = copied / "tiny_controller" / "src" / "tiny_controller.cpp"
    source.write_text(source.read_text().replace('declare("speed", 0.3)', 'declare("speed", 0.4)'))
    out, junit = tmp_path / "out", tmp_path / "gate.xml"
    arguments = ["nav2-gate", "tiny", str(copied), "--controllers", "tiny::Controller"]
    arguments += ["--scenarios", "empty", "--trials", "2", "--jobs", "1"]
    # Two pairs are too few for an alarm, whatever they do.
    assert main([*arguments, "--out", str(out), "--junit", str(junit)]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("# Nav2 gate: green\n")
    assert "2 pairs of equal seed, of which 0 drove the same" in shown
    assert 'classname="empty.tiny::Controller" name="success_rate"' in junit.read_text()
    assert (out / "manifest.json").is_file()
    assert "tiny::Controller" in find_build("gate-head").controllers


def test_a_build_that_is_not_there_is_one_line(builds, capsys):
    assert main(["nav2-gate", "nowhere", "nowhere", "--controllers", "rpp"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("build 'nowhere' is not known")
    assert error.count("\n") == 1
