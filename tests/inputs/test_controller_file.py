"""`--controllers path/to/file.py:Class`: a controller that no package carries."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

from drake_navbench import run_benchmark
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.commands.run import main
from drake_navbench.errors import InputError
from drake_navbench.inputs.foreign_code import runs_foreign_code
from drake_navbench.inputs.presets import load_preset
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.nav2.controllers import load_parameter_file

CODE = """
import numpy as np
from pydantic import Field
from drake_navbench.controller import ControllerParameters, Decision

class CreepParameters(ControllerParameters):
    speed: float = Field(0.3, gt=0.0)

class Creep:
    Parameters = CreepParameters
    nav2_plugin = None

    def __init__(self, parameters, setup):
        self._speed = parameters.speed

    def initial_memory(self):
        return None

    def step(self, observation, memory):
        return Decision(np.array([self._speed, 0.0]), memory)
"""
SCENARIO = "description: nothing in the way\ngoal: [0.4, 0.0, 0.0]\ntimeout_s: 4.0\n"


@pytest.fixture
def file(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.yaml").write_text(SCENARIO)
    path = tmp_path / "creep.py"
    path.write_text(CODE)
    return path


def test_it_drives_as_a_column_and_is_gone_on_with_only_as_it_was(file, capsys):
    run_benchmark(["short.yaml"], ["creep.py:Creep:speed=0.4"], trials=1, jobs=1, out="out")
    (path,) = Path("out/trials").rglob("*.parquet")
    log = TrialLog.read(path)
    assert log.outcome is Outcome.SUCCEEDED
    assert log.info["controller"] == "creep.py:Creep:speed=0.4"
    digests = {"creep.py": hashlib.sha256(CODE.encode()).hexdigest()}
    assert log.info["controller_files"] == digests
    manifest = json.loads(Path("out/manifest.json").read_text())
    assert manifest["controller_files"] == {"creep.py:Creep:speed=0.4": digests}
    file.write_text(CODE + "\n# another controller\n")
    assert main(["--resume", "out"]) == 2
    told = capsys.readouterr().err
    assert "creep.py_Creep" in told
    assert "has changed since the run started" in told


def test_it_is_foreign_code_and_driven_in_workers_of_its_own(file):
    assert runs_foreign_code(load_preset("creep.py:Creep"))
    (spec,) = plan_campaign(["short.yaml"], ["creep.py:Creep"], trials=1).specs
    assert spec.code_owner == "creep.py:Creep"
    digest = hashlib.sha256(CODE.encode()).hexdigest()
    assert spec.foreign_code == {"controller creep.py:Creep": f"creep.py {digest[:12]}"}


def test_another_content_is_another_trial(file):
    before = plan_campaign(["short.yaml"], ["creep.py:Creep"], trials=1).identity
    assert plan_campaign(["short.yaml"], ["creep.py:Creep"], trials=1).identity == before
    file.write_text(CODE + "\n# another controller\n")
    assert plan_campaign(["short.yaml"], ["creep.py:Creep"], trials=1).identity != before


def test_a_file_that_changes_between_the_question_and_the_trial_is_not_run(file):
    preset = load_preset("creep.py:Creep")
    reference = preset.file
    file.write_text(CODE.replace("0.0]), memory", "0.1]), memory"))
    with pytest.raises(InputError, match=r"creep\.py: the file has changed since the run started"):
        reference._replace(class_name="CreepParameters").load()


def test_a_preset_file_may_name_one_beside_itself(file, tmp_path, monkeypatch):
    (tmp_path / "mine.yaml").write_text(
        "controller: creep.py:Creep\ndescription: slow\nparameters: {speed: 0.1}\n"
    )
    monkeypatch.chdir("/")
    (preset,) = load_parameter_file(tmp_path / "mine.yaml")
    assert preset.name == "mine"
    assert preset.parameters.speed == 0.1
    assert preset.controller_class.__name__ == "Creep"


@pytest.mark.parametrize(
    ("asked", "code", "told"),
    [
        ("gone.py:Creep", None, "gone.py: cannot be read: No such file or directory"),
        ("creep.py", CODE, "got '', expected creep.py:Class; known: Creep, CreepParameters"),
        ("creep.py:speed=1", CODE, "got 'speed=1', expected creep.py:Class"),
        ("creep.py:Crep", CODE, "no such class; did you mean 'Creep'?"),
        (
            "creep.py:Creep",
            "class Creep: pass",
            "is not a class with Parameters, nav2_plugin, init",
        ),
        ("creep.py:Creep", "Creep = 3", "Creep is not a class with "),
        ("creep.py:Creep", "\n1 / 0", "cannot be loaded: ZeroDivisionError: division by zero (l"),
        ("creep.py:Creep", "a b", "cannot be loaded: SyntaxError: invalid syntax"),
        ("creep.py:Creep", "raise SystemExit", "cannot be loaded: SystemExit (line 1)"),
        ("creep.py:Creep:speed=no", CODE, "controller creep.py:Creep:speed=no: speed: "),
        ("creep.py:Creep:spede=1", CODE, "controller creep.py:Creep:spede=1: spede: "),
        ("creep.py:Creep:1", CODE, "got '1': expected param=value"),
    ],
)
def test_what_is_wrong_is_one_line(asked, code, told, file, capsys):
    if code is not None:
        file.write_text(code)
    assert main(["short.yaml", "--controllers", asked]) == 2
    line = capsys.readouterr().err
    assert told in line
    assert line.count("\n") == 1
    assert not Path("results").exists()


def test_files_separated_by_spaces_are_told_to_need_commas(file, capsys):
    assert main(["--controllers", "rpp", "creep.py:Creep"]) == 2
    assert "--controllers rpp,creep.py:Creep" in capsys.readouterr().err
