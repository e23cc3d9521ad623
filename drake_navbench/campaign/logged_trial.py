"""The specification of a logged trial, found by the request of its run."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from drake_navbench.campaign.manifest import Begun
from drake_navbench.campaign.request import Request
from drake_navbench.errors import InputError
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.processes.version import __version__
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import DEFAULT_ROBOT
from drake_navbench.typed_files.typed_yaml import validate


def logged_trial(log: TrialLog, path: Path) -> TrialSpec:
    """Returns the specification of a logged trial; raises InputError.

    path: path of the log. In a results folder, whose manifest holds the request of the run, its
    inputs are loaded again. For a log anywhere else, scenario and column are searched among the
    built-in ones, with the default robot. The log's identity tells whether they are the driven
    ones.
    """
    scenario, column = log.info["scenario"]["name"], log.info["controller"]
    request = _request(path) or _built_in(scenario, column)
    try:
        specs = _narrowed(request, scenario, column).campaign().specs
    except InputError as error:
        raise InputError(f"the inputs of the trial cannot be loaded again: {error}") from error
    for spec in specs:
        if (spec.scenario.name, spec.preset.name) == (scenario, column):
            return trial_of_log(spec, log)
    raise InputError(f"the inputs of the trial have no column {column!r} in {scenario!r} any more")


def trial_of_log(spec: TrialSpec, log: TrialLog) -> TrialSpec:
    """Returns the logged trial among those of a scenario and column; raises InputError."""
    for wants_diagnostics in (False, True):
        trial = replace(spec, wants_diagnostics=wants_diagnostics)
        trial = trial.numbered(log.info["trial"], log.info["seed"])
        if trial.identity == log.info.get("identity"):
            return replace(trial, wants_diagnostics=False)
    raise InputError(
        "scenario, robot, parameters, files or plugins are not those that the log was driven with, "
        f"or its version was not {__version__}; expected unchanged inputs"
    )


def _request(path: Path) -> Request | None:
    """Returns the request of the run in whose results folder a log lies; None without one."""
    with suppress(InputError, IndexError):
        manifest = ResultsFolder(path.absolute().parents[3]).read_manifest()
        return validate(Begun, manifest, "manifest").request
    return None


def _built_in(scenario: str, column: str) -> Request:
    return validate(
        Request,
        {
            "scenarios": [scenario],
            "controllers": [column],
            "parameter_files": [],
            "trials": 1,
            "seed": 0,
            "robot": DEFAULT_ROBOT,
            "replay": "none",
        },
        "log",
    )


def _narrowed(request: Request, scenario: str, column: str) -> Request:
    """Returns the request without other scenarios and columns, which then need not be loaded."""
    changes: dict[str, object] = {"trials": 1}
    if not request.sweeps and scenario in request.scenarios:
        changes |= {"scenarios": (scenario,), "map_task": None, "barn": None}
    if not request.sweeps and column in request.controllers:
        changes |= {"controllers": (column,), "parameter_files": ()}
    return request.model_copy(update=changes)
