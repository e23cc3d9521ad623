"""The gate from two checkouts to its exit status, with a controller of our own."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from plain_package import SOURCE

from drake_navbench.commands.main import main
from drake_navbench.errors import InputError
from drake_navbench.native.builds import FlagSet, NoiseSource, find_build
from drake_navbench.studies.side_by_side.gate_builds import build_of, left_out_changes

SAMPLING = ["sampling::Controller"]


@pytest.mark.long
def test_a_change_is_driven_and_told(tiny, copied, tmp_path, capsys):
    source = copied / "tiny_controller" / "src" / "tiny_controller.cpp"
    source.write_text(source.read_text().replace('declare("speed", 0.3)', 'declare("speed", 0.4)'))
    out, junit = tmp_path / "out", tmp_path / "gate.xml"
    arguments = ["nav2-gate", "tiny", str(copied), "--controllers", "tiny::Controller"]
    # With the flags of the other build, of which most objects serve.
    arguments += ["--scenarios", "empty", "--trials", "2", "--jobs", "1", "--flags", "portable"]
    status = main([*arguments, "--out", str(out), "--junit", str(junit)])
    shown = capsys.readouterr().out
    # Two pairs decide only where nothing in them is random.
    assert status == int("which counts once: tiny::Controller in empty" in shown)
    assert shown.startswith(f"# Nav2 gate: {'red' if status else 'green'}\n")
    assert "0 of 2 pairs of trials are equal in outcome and all metrics" in shown
    assert 'classname="empty.tiny::Controller" name="success_rate"' in junit.read_text()
    assert (out / "manifest.json").is_file()
    assert "tiny::Controller" in find_build("gate-head").controllers


def test_a_build_that_is_not_there_is_one_line(builds, capsys):
    assert main(["nav2-gate", "nowhere", "nowhere", "--controllers", "rpp"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("build 'nowhere' is not known")
    assert error.count("\n") == 1


@pytest.mark.usefixtures("nothing_compiled")
def test_a_checkout_is_built_as_its_users_run_it_with_other_noise_in_each_trial(sampling):
    source = sampling / "nav2_mppi_controller" / "src" / "sampling_controller.cpp"
    source.write_text(SOURCE.format(name="sampling"))
    build = build_of(str(sampling), "gate-base", SAMPLING, tell=print)
    assert (build.flags, build.noise) == (FlagSet.PACKAGE, NoiseSource.BENCHMARK)
    assert build_of("gate-base", "", SAMPLING, tell=print) == build
    with pytest.raises(InputError, match="--flags portable: build 'gate-base' has flags package"):
        build_of("gate-base", "", SAMPLING, flags=FlagSet.PORTABLE, tell=print)
    own = build_of(str(sampling), "gate-head", SAMPLING, noise=NoiseSource.OWN, tell=print)
    assert own.noise is NoiseSource.OWN


@pytest.mark.usefixtures("nothing_compiled")
def test_what_draws_no_numbers_has_its_own(copied):
    names, flags = ["tiny::Controller"], FlagSet.PORTABLE
    build = build_of(str(copied), "gate-base", names, flags=flags, tell=print)
    assert build.noise is NoiseSource.OWN
    with pytest.raises(InputError, match="draw no random numbers; expected a build of"):
        build_of(str(copied), "x", names, noise=NoiseSource.BENCHMARK, tell=print)


def test_a_change_of_what_is_not_driven_is_named(sampling, tmp_path):
    head = Path(shutil.copytree(sampling, tmp_path / "head"))
    roots = str(sampling), str(head)
    assert left_out_changes(*roots, SAMPLING) == []
    source = head / "nav2_mppi_controller" / "src" / "noise_generator.cpp"
    source.write_text(source.read_text() + "// changed\n")
    assert left_out_changes(*roots, SAMPLING) == ["nav2_mppi_controller/src/noise_generator.cpp"]
    assert left_out_changes(*roots, ["tiny::Controller"]) == []
    assert left_out_changes("tiny", roots[1], SAMPLING) == []
