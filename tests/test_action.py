"""The GitHub Action: every `run` step is executed here, as a runner would, but for the network.

That a hosted runner ran it is not claimed.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import re
import shutil
import stat
import subprocess
import time
from functools import lru_cache
from pathlib import Path

import pytest
import yaml

from drake_navbench.commands.main import main
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.trial.trial import run_trial

REPOSITORY = Path(__file__).parents[1]
ACTION = yaml.safe_load((REPOSITORY / "action.yml").read_text(encoding="utf-8"))
STEPS = {step["name"]: step for step in ACTION["runs"]["steps"] if "run" in step}
SCENARIO = """\
description: two metres ahead
goal: [2.0, 0.0, 0.0]
plan: {{type: polyline, points: [[0.0, 0.0], [2.0, 0.0]]}}
timeout_s: {timeout_s}
"""
QUICK = "short.yaml --controllers rpp --trials 1 --jobs 1 --replay none --figures none"
# What pip and gh would do outside is written down instead.
STUB = """\
#!/usr/bin/env bash
printf '%s\\n' "$*" >>"$CALLS/{name}"
{more}
"""


# Asks the tests' process for a command, and passes on what it printed.
ASK = """[[ "$1 $2" == "-m drake_navbench" ]]
printf '%s\\0' "$PWD" "${{@:3}}" >"{folder}/asking"
mv "{folder}/asking" "{folder}/asked"
read -r status <"{folder}/answer"
cat "{folder}/out"
cat "{folder}/err" >&2
exit "$status"
"""


class Runner:
    """Executes the steps of the action in a workspace with two commits."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.workspace = folder, folder / "workspace"
        self.calls, self.temp = folder / "calls", folder / "temp"
        self.outputs: dict[str, dict[str, str]] = {}
        for path in (self.workspace, self.calls, self.temp, folder / "bin"):
            path.mkdir()
        self._stub("gh", '[[ "$*" != *--jq* ]] || echo "${COMMENT_ID:-}"')
        # The modules of the package are those under test; only pip is kept from the network.
        self._asked = folder / "asked"
        os.mkfifo(folder / "answer")
        self.stub_python()
        self.env = {
            "PATH": f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}",
            "HOME": str(folder),
            "CALLS": str(self.calls),
            "RUNNER_TEMP": str(self.temp),
            "GITHUB_OUTPUT": str(folder / "output"),
            "GITHUB_STEP_SUMMARY": str(folder / "summary.md"),
            "GIT_CONFIG_GLOBAL": "/dev/null",
        } | {key: value for key, value in os.environ.items() if key.startswith("NUMBA")}
        self._git("init", "--quiet")
        self._git("config", "user.email", "a@b.c")
        self._git("config", "user.name", "a")

    def stub_python(self, driven: str = "") -> None:
        """Lets Python do all but install; driven: shell code in place of driving trials.

        `python -m drake_navbench` is asked of this process, which answers while the step runs.
        """
        lines = ['[[ "$1 $2" == "-m pip" ]] && exit']
        if driven:
            lines.append(f'[[ "$3" == run ]] && {{ {driven}; exit; }}')
        self._stub("python", "\n".join([*lines, ASK.format(folder=self.folder)]))

    def commit(self, **values: object) -> str:
        """Commits the scenario; returns the commit."""
        (self.workspace / "short.yaml").write_text(SCENARIO.format(**values))
        self._git("add", "-A")
        self._git("commit", "--quiet", "-m", "change")
        return self._git("rev-parse", "HEAD").strip()

    def run(self, name: str, context: dict[str, str]) -> subprocess.CompletedProcess[str]:
        """Executes a step; context: what its expressions stand for."""
        step = STEPS[name]
        output = Path(self.env["GITHUB_OUTPUT"])
        output.write_text("")
        own = {key: self._evaluated(text, context) for key, text in step.get("env", {}).items()}
        script = self.folder / "step.sh"
        script.write_text(step["run"])
        done = self._run_script(script, self.env | own)
        if "id" in step:
            lines = [line.partition("=") for line in output.read_text().splitlines()]
            self.outputs[step["id"]] = {key: value for key, _, value in lines}
        return done

    def _run_script(self, script: Path, env: dict[str, str]) -> subprocess.CompletedProcess[str]:
        """Runs a step's script, and answers what it asks of `python -m drake_navbench`."""
        out, err = (self.folder / name for name in ("stdout", "stderr"))
        with out.open("w") as to_out, err.open("w") as to_err:
            process = subprocess.Popen(
                # As a runner calls it for `shell: bash`.
                ["bash", "--noprofile", "--norc", "-eo", "pipefail", script],
                env=env,
                cwd=self.workspace,
                stdout=to_out,
                stderr=to_err,
            )
            while process.poll() is None:
                time.sleep(0.01)
                if self._asked.exists():
                    self._answer()
        return subprocess.CompletedProcess(
            script, process.returncode, out.read_text(), err.read_text()
        )

    def _answer(self) -> None:
        """Runs a command in this process, in the folder in which it was asked for."""
        folder, *argv = self._asked.read_text().split("\0")[:-1]
        self._asked.unlink()
        with (
            (self.folder / "out").open("w") as out,
            (self.folder / "err").open("w") as err,
            contextlib.chdir(folder),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
        ):
            status = main(argv)
        (self.folder / "answer").write_text(f"{status}\n")

    def called(self, name: str) -> list[str]:
        """Returns how a program was called, a line each."""
        path = self.calls / name
        return path.read_text().splitlines() if path.exists() else []

    def _evaluated(self, text: str, context: dict[str, str]) -> str:
        def value(found: re.Match[str]) -> str:
            for name in found[1].split("||"):
                parts = name.strip().split(".")
                if parts[0] == "steps":
                    known = self.outputs.get(parts[1], {}).get(parts[3], "")
                else:
                    known = context.get(name.strip(), "")
                if known:
                    return known
            return ""

        return re.sub(r"\$\{\{(.*?)\}\}", value, text)

    def _stub(self, name: str, more: str) -> None:
        path = self.folder / "bin" / name
        path.write_text(STUB.format(name=name, more=more))
        path.chmod(path.stat().st_mode | stat.S_IXUSR)

    def _git(self, *arguments: str) -> str:
        command = ["git", "-C", self.workspace, *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def context(runner: Runner, **more: str) -> dict[str, str]:
    inputs = {f"inputs.{name}": str(entry.get("default", "")) for name, entry in INPUTS.items()}
    return (
        inputs
        | {
            "inputs.arguments": QUICK,
            "github.action_path": str(REPOSITORY),
            "github.workspace": str(runner.workspace),
            "github.repository": "someone/robot",
            "github.token": "secret",
        }
        | more
    )


INPUTS = ACTION["inputs"]


@pytest.fixture
def runner(tmp_path) -> Runner:
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    return Runner(tmp_path)


def test_expressions_stand_in_env_alone_where_a_shell_cannot_take_them_for_code():
    for step in STEPS.values():
        assert "${{" not in step["run"], step["name"]
        assert step["shell"] == "bash"


def test_every_expression_names_something_that_there_is():
    ids = {step["id"] for step in ACTION["runs"]["steps"] if "id" in step}
    found = re.findall(r"\$\{\{(.*?)\}\}", (REPOSITORY / "action.yml").read_text())
    for name in (part.strip() for text in found for part in text.split("||")):
        if name.startswith("inputs."):
            assert name.removeprefix("inputs.") in INPUTS
        elif name.startswith("steps."):
            assert name.split(".")[1] in ids
        else:
            assert name.startswith("github.")


@pytest.mark.long
def test_a_pull_request_that_drives_worse_is_refused(runner):
    base = runner.commit(timeout_s=30)
    # Too short a time to arrive.
    runner.commit(timeout_s=2)
    # Seven trials that all differ in one direction decide: 2 / 2^7 < 3%.
    require_refused(runner, base, QUICK.replace("--trials 1", "--trials 7"))
    assert "timed out" in (runner.temp / "drake_navbench" / "worst_trial.html").read_text()


def test_a_pull_request_that_makes_it_worse_is_compared_shown_commented_and_refused(
    runner, tmp_path
):
    base = runner.commit(timeout_s=30)
    runner.commit(timeout_s=2)
    # Driven beforehand: what arrived at the base is given up after the change.
    for name, failing in (("results_base", ()), ("results", (0, 1, 2))):
        folder = ResultsFolder(tmp_path / "driven" / name)
        for trial in range(3):
            outcome = "aborted" if trial in failing else "succeeded"
            folder.write_log(with_trial(outcome, trial))
        folder.write_manifest({"scenarios": ["restricted_small"], "controllers": ["rpp"]})
    # The folder is the last argument but one.
    runner.stub_python(f'cp -r "{tmp_path}/driven/$(basename "${{@: -2:1}}")" "${{@: -2:1}}"')
    require_refused(runner, base)
    assert "aborted" in (runner.temp / "drake_navbench" / "worst_trial.html").read_text()


def test_a_loss_that_is_not_decided_is_a_warning_and_fails_nothing(runner):
    folder = runner.temp / "drake_navbench"
    for name, failing in (("results_base", ()), ("results", (2,))):
        results = ResultsFolder(folder / name)
        for trial in range(3):
            results.write_log(with_trial("collided" if trial in failing else "succeeded", trial))
        results.write_manifest({"scenarios": ["restricted_small"], "controllers": ["rpp"]})
    runner.outputs["prepare"] = {"folder": str(folder)}
    done = runner.run("Compare", context(runner))
    assert (done.returncode, runner.outputs["compare"]["regressed"]) == (0, "false")
    assert "::warning::more touches or fewer arrivals than before" in done.stdout
    assert "touch_rate undecided: 0 -> 33.33 %" in (folder / "comparison.md").read_text()


def test_a_change_of_which_a_trial_is_missing_is_refused(runner):
    # As of a worker that was killed from outside, after which the run goes on.
    folder = runner.temp / "drake_navbench"
    for name, trials in (("results_base", 3), ("results", 2)):
        results = ResultsFolder(folder / name)
        for trial in range(trials):
            results.write_log(with_trial("succeeded", trial))
        results.write_manifest({"scenarios": ["restricted_small"], "controllers": ["rpp"]})
    runner.outputs["prepare"] = {"folder": str(folder)}
    done = runner.run("Compare", context(runner))
    assert (done.returncode, runner.outputs["compare"]["regressed"]) == (0, "true")
    assert "1 trial has no partner" in (folder / "comparison.md").read_text()


def with_trial(outcome: str, trial: int) -> TrialLog:
    log = driven()
    scenario = dict(log.info["scenario"]) | {"expected_outcome": "succeeded"}
    told = {"trial": trial, "seed": trial, "outcome": outcome, "scenario": scenario}
    return dataclasses.replace(log, info=dict(log.info) | told)


@lru_cache(maxsize=1)
def driven() -> TrialLog:
    return run_trial("restricted_small", "rpp")


def require_refused(runner: Runner, base: str, arguments: str = QUICK) -> None:
    """Runs all steps for a pull request that makes it worse."""
    of_pull_request = context(
        runner,
        **{
            "github.event.pull_request.base.sha": base,
            "github.event.pull_request.number": "7",
            "inputs.install": ".",
            "inputs.arguments": arguments,
        },
    )
    results = {}
    for name in STEPS:
        results[name] = runner.run(name, of_pull_request)
        if name != "Judge":
            assert results[name].returncode == 0, results[name].stderr
    folder = runner.temp / "drake_navbench"
    assert f"-m pip install --quiet {REPOSITORY}" in runner.called("python")[0]
    assert runner.called("python").count("-m pip install --quiet .") == 2
    assert runner.outputs["compare"]["regressed"] == "true"
    markdown = (folder / "comparison.md").read_text()
    assert "success_rate" in markdown
    assert (runner.folder / "summary.md").read_text() == markdown
    assert "<testsuite" in (folder / "comparison.xml").read_text()
    posted = runner.called("gh")
    assert "repos/someone/robot/issues/7/comments" in posted[0]
    assert f"--field body=@{folder / 'comment.md'}" in posted[1]
    assert (folder / "comment.md").read_text() == f"<!-- drake_navbench -->\n{markdown}"
    assert results["Judge"].returncode == 1
    assert "::error::" in results["Judge"].stdout
    # The next push writes the same comment anew.
    runner.env["COMMENT_ID"] = "42"
    runner.run("Comment on the pull request", of_pull_request)
    assert "--method PATCH repos/someone/robot/issues/comments/42" in runner.called("gh")[-1]


def test_without_a_base_there_is_nothing_to_compare(runner):
    runner.commit(timeout_s=30)
    of_push = context(runner)
    for name in ("Install drake_navbench", "Drive the base", "Compare", "Judge"):
        done = runner.run(name, of_push)
        assert done.returncode == 0, (name, done.stderr)
    assert [path.name for path in (runner.temp / "drake_navbench").iterdir()] == []
    assert "regressed" not in runner.outputs["compare"]


def test_wrong_arguments_fail_the_step_that_has_them(runner):
    runner.commit(timeout_s=30)
    wrong = context(runner, **{"inputs.arguments": "'no such scenario' --trials 1"})
    assert runner.run("Install drake_navbench", wrong).returncode == 0
    done = runner.run("Drive the change", wrong)
    assert done.returncode != 0
    assert "no such scenario" in done.stderr


def test_a_comment_that_may_not_be_written_is_no_failure(runner):
    (runner.temp / "drake_navbench").mkdir()
    (runner.temp / "drake_navbench" / "comparison.md").write_text("equal")
    runner.outputs["prepare"] = {"folder": str(runner.temp / "drake_navbench")}
    runner._stub("gh", "exit 1")
    done = runner.run("Comment on the pull request", context(runner))
    assert done.returncode == 0
    assert "::warning::" in done.stdout
