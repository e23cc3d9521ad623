"""A report is made whatever names a folder has and whoever kills its workers, within the folder."""

from __future__ import annotations

import multiprocessing
import os
import signal
import xml.etree.ElementTree as ET
from hashlib import sha256

import pytest
import results_folders
from results_folders import measured_folder, write_folder

from drake_navbench.analysis import folder_analysis
from drake_navbench.analysis.figures import album
from drake_navbench.analysis.figures.choice import FigureChoice
from drake_navbench.analysis.figures.style import Look, figure_style, legend_below, new_figure
from drake_navbench.analysis.report import build_report
from drake_navbench.commands.report import main
from drake_navbench.commands.run import main as run_main
from drake_navbench.errors import InputError

pytestmark = pytest.mark.usefixtures("real_workers")


@pytest.mark.parametrize("name", ["$\\frac{$", "$x^2$", "_hidden", "a & b <i>", "$"])
def test_a_name_is_text_in_a_figure(name, tmp_path):
    with figure_style():
        figure, (axes,) = new_figure()
        axes.set_xticks([0], [name])
        axes.set_title(name)
        legend_below(figure, Look([name]).line_keys([name]))
        figure.savefig(tmp_path / "figure.svg")
    words = ["".join(node.itertext()) for node in ET.parse(tmp_path / "figure.svg").iter()]
    # As a tick, as the title and in the legend.
    assert words.count(name) >= 3


def test_a_report_tells_of_a_controller_by_its_name(tmp_path, monkeypatch):
    name = "$\\frac{$"
    monkeypatch.setitem(results_folders.SPEEDS_MPS, name, 0.45)
    monkeypatch.setattr(results_folders, "CONTROLLERS", (name, "rpp"))
    monkeypatch.setattr(results_folders, "SCENARIOS", ("own_corridor",))
    path = write_folder(tmp_path / "campaign")
    build_report(path, figures=FigureChoice.KEY, jobs=1)
    figures = list((path / "figures" / "own_corridor").glob("*.svg"))
    assert len(figures) >= 4
    assert all(any(name == node.text for node in ET.parse(own).iter()) for own in figures)


def kill_worker(*arguments):
    os.kill(os.getpid(), signal.SIGKILL)


def killed_while(monkeypatch, tmp_path, times):
    """Lets the first workers that draw figures be killed, so many of them."""
    drawn = album.write_scenario_figures

    def draw(folder, scenario, *rest, **named):
        if scenario == "empty" and rest[-1] is not FigureChoice.NONE:
            for number in range(times):
                mark = tmp_path / f"killed_{number}"
                if not mark.exists():
                    mark.touch()
                    kill_worker()
        return drawn(folder, scenario, *rest, **named)

    monkeypatch.setattr(album, "write_scenario_figures", draw)
    # Forked, so that workers have what is patched here.
    context = multiprocessing.get_context("fork")
    monkeypatch.setattr(multiprocessing, "get_context", lambda kind=None: context)


@pytest.mark.long
@pytest.mark.usefixtures("blank_svgs")
def test_a_worker_that_is_killed_while_it_draws_is_replaced(tmp_path, monkeypatch):
    path = measured_folder(tmp_path / "campaign")
    killed_while(monkeypatch, tmp_path, 1)
    result = build_report(path, figures=FigureChoice.KEY, jobs=2)
    assert (tmp_path / "killed_0").exists()
    assert result.left_out == []
    assert (path / "figures" / "empty" / "paths.svg").is_file()


@pytest.mark.usefixtures("blank_svgs")
def test_figures_whose_workers_are_always_killed_are_left_out_and_told(tmp_path, monkeypatch):
    path = measured_folder(tmp_path / "campaign")
    killed_while(monkeypatch, tmp_path, 99)
    result = build_report(path, figures=FigureChoice.KEY, jobs=2)
    assert (tmp_path / "killed_1").exists()
    assert not (tmp_path / "killed_2").exists()
    (left_out,) = result.left_out
    assert left_out.path == "figures/empty"
    assert left_out.reason == "not drawn: the worker process was ended by signal 9 (Killed)"
    assert result.trial_count == 12
    page = result.path.read_text()
    assert "1 file could not be read or drawn" in page
    assert left_out.reason in page
    assert (path / "figures" / "own_corridor" / "paths.svg").is_file()


@pytest.mark.usefixtures("blank_svgs")
def test_a_scenario_whose_workers_are_always_killed_is_left_out(tmp_path, monkeypatch):
    path = write_folder(tmp_path / "campaign")
    killed_while(monkeypatch, tmp_path, 0)
    read = folder_analysis.read_trials
    monkeypatch.setattr(
        folder_analysis,
        "read_trials",
        lambda paths, *rest: (
            kill_worker() if paths[0].parent.parent.name == "empty" else read(paths, *rest)
        ),
    )
    result = build_report(path, figures=FigureChoice.KEY, jobs=2)
    assert result.trial_count == 6
    assert [entry.path for entry in result.left_out] == [
        f"trials/empty/{column}/trial_{trial:03d}.parquet"
        for column in ("rpp", "rpp_v_0.4-" + hash_of("rpp:v=0.4"))
        for trial in range(3)
    ]


def hash_of(name: str) -> str:
    return sha256(name.encode()).hexdigest()[:6]


@pytest.mark.parametrize("name", ["tables", "figures", "trials/empty"])
def test_a_report_writes_through_no_link(name, tmp_path, capsys):
    path = write_folder(tmp_path / "campaign")
    victim = tmp_path / "victim"
    place = path / name
    if place.exists():
        place.rename(victim)
    else:
        victim.mkdir()
    before = sorted(victim.rglob("*"))
    place.symlink_to(victim)
    assert main([str(path)]) == 2
    error = capsys.readouterr().err
    assert error == f"{place}: is a link to {victim}; expected a folder of its own\n"
    assert sorted(victim.rglob("*")) == before
    with pytest.raises(InputError, match="is a link to"):
        build_report(path)


def test_a_run_goes_on_through_no_link(tmp_path, capsys):
    out, outside = tmp_path / "out", tmp_path / "outside"
    scenario = tmp_path / "short.yaml"
    scenario.write_text("description: short\ngoal: [0.5, 0.0, 0.0]\n")
    asked = [str(scenario), "--controllers", "rpp", "--trials", "1", "--quiet", "--jobs", "1"]
    assert run_main([*asked, "--replay", "none", "--figures", "none", "--out", str(out)]) == 0
    (out / "trials").rename(outside)
    (out / "trials").symlink_to("../outside")
    log = next(outside.rglob("*.parquet"))
    log.unlink()
    assert run_main(["--resume", str(out), "--quiet"]) == 2
    assert capsys.readouterr().err == (
        f"{out}/trials: is a link to ../outside; expected a folder of its own\n"
    )
    assert not log.exists()
