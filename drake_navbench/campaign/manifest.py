"""Writes and reads a results folder's record of its run: the manifest and the resolved inputs."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from datetime import datetime
from hashlib import sha256
from importlib.metadata import version
from typing import Any

from pydantic import ConfigDict

from drake_navbench.campaign.campaign import Campaign
from drake_navbench.campaign.request import Request
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import as_yaml
from drake_navbench.logs.results import ResultsFolder, file_name, remove_unfinished
from drake_navbench.nav2.differences import difference_lines, differences
from drake_navbench.processes.fingerprint import Fingerprint
from drake_navbench.processes.machine import machine_facts
from drake_navbench.processes.version import __version__
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.typed_files.output_file import write_text
from drake_navbench.typed_files.typed_yaml import FrozenModel
from drake_navbench.typed_files.yaml_loader import dump_yaml

PACKAGES_IN_MANIFEST = ("drake", "numba", "numpy", "pandas", "pyarrow", "scipy")


class Begun(FrozenModel):
    """The entries of a manifest that `--resume` needs."""

    model_config = ConfigDict(extra="ignore")

    request: Request
    inputs: dict[str, str]
    identity: str
    drake_navbench: str
    wall_clock_s: float = 0.0


def begin(folder: ResultsFolder, campaign: Campaign, request: Request | None, jobs: int) -> None:
    """Writes the manifest and the resolved inputs; without a request no run can be resumed."""
    inputs = _inputs(campaign)
    remove_unfinished(folder.path)
    request_entry = {} if request is None else {"request": request.model_dump(mode="json")}
    machines = {"machines": [machine_facts(jobs)]}
    folder.write_manifest(request_entry | machines | _manifest(campaign, inputs))
    _write_inputs(folder, inputs)


def complete(folder: ResultsFolder, campaign: Campaign, jobs: int) -> None:
    """Writes the files about inputs that an interrupted run did not get to write.

    It also adds an entry on this machine and its number of workers to the manifest.
    """
    remove_unfinished(folder.path)
    manifest = folder.read_manifest()
    manifest["machines"] = [*manifest.get("machines", []), machine_facts(jobs)]
    folder.write_manifest(manifest)
    _write_inputs(folder, _inputs(campaign))


def require_same_inputs(folder: ResultsFolder, campaign: Campaign, begun: Begun) -> None:
    """Raises InputError where inputs, version or trials are not those of the run that began."""
    for name, digest in _hashes(_inputs(campaign)).items():
        if begun.inputs.get(name) != digest:
            raise InputError(
                f"--resume {folder.path}: inputs/{name} has changed since the run started; "
                "expected unchanged scenarios, robots and parameters"
            )
    if begun.drake_navbench != __version__:
        raise InputError(
            f"--resume {folder.path}: started with version {begun.drake_navbench}, "
            f"this is {__version__}; expected the same version"
        )
    if begun.identity != campaign.identity:
        raise InputError(
            f"--resume {folder.path}: its trials are no longer those of the started run; expected "
            "unchanged maps, files of controllers and plugins"
        )


def add_wall_clock(folder: ResultsFolder, wall_s: float) -> None:
    """Adds the duration of the trials to the manifest; a resumed run adds to the earlier one."""
    manifest = folder.read_manifest()
    manifest["wall_clock_s"] = manifest.get("wall_clock_s", 0.0) + wall_s
    folder.write_manifest(manifest)


def add_verdict(folder: ResultsFolder, text: str) -> None:
    """Adds the verdict of the run, in words, to the manifest."""
    folder.write_manifest({**folder.read_manifest(), "verdict": text})


def add_cluster(folder: ResultsFolder, machines: Sequence[tuple[Fingerprint, int]]) -> str:
    """Adds to the manifest the number of trials that each machine of a cluster drove.

    Returns a warning where processors differ: compiled kernels round as the processor does, so only
    trials on equal processors are equal to the last bit.
    """
    manifest = folder.read_manifest()
    driven = [{"trials": count, **found._asdict()} for found, count in machines]
    manifest["cluster"] = [*manifest.get("cluster", []), *driven]
    folder.write_manifest(manifest)
    kinds = {entry["features"]: entry["processor"] for entry in manifest["cluster"]}
    if len(kinds) == 1:
        return ""
    return (
        f"driven on {len(kinds)} kinds of processors, which may round differently: "
        f"{', '.join(kinds.values())}; manifest.json lists them"
    )


def _write_inputs(folder: ResultsFolder, inputs: dict[str, str]) -> None:
    for name, text in inputs.items():
        write_text(folder.path / "inputs" / name, text)


def _manifest(campaign: Campaign, inputs: dict[str, str]) -> dict[str, Any]:
    setups = [columns.setup for columns in campaign.nav2]
    own = {
        name: [line for setup in setups for line in setup.stand_ins_of(name)]
        for name in campaign.columns
    }
    return {
        "stand_ins": [
            f"{columns.name}: {line}" if len(setups) > 1 else line
            for columns in campaign.nav2
            for line in columns.setup.stand_ins_of_all()
        ],
        **({"nav2_columns": columns_by_file(campaign)} if setups else {}),
        "stand_ins_of_columns": {name: lines for name, lines in own.items() if lines},
        "scenarios": campaign.scenarios,
        "suites": campaign.suites,
        "controllers": campaign.columns,
        "controller_files": {
            preset.name: preset.file_hashes for preset in campaign.presets if preset.file_hashes
        },
        "sweep": campaign.sweep,
        "inputs": _hashes(inputs),
        "identity": campaign.identity,
        "drake_navbench": __version__,
        "python": platform.python_version(),
        "packages": {name: version(name) for name in PACKAGES_IN_MANIFEST},
        **({"plugins": campaign.foreign_code} if campaign.foreign_code else {}),
        "platform": f"{platform.system()} {platform.machine()}",
        "created": datetime.now().astimezone().isoformat(timespec="seconds"),
    }


def columns_by_file(campaign: Campaign) -> dict[str, dict[str, str]]:
    """Returns the columns of each whole Nav2 file: by the file's alias, then by plugin."""
    return {
        columns.name: {plugin: preset.name for plugin, preset in columns.plugins.items()}
        for columns in campaign.nav2
    }


def _inputs(campaign: Campaign) -> dict[str, str]:
    """Returns every resolved input file of a campaign: name in inputs/ -> text.

    Maps, masks and files that controllers consist of or read are given by hashes only.
    """
    texts = {}
    # The first column's robot; those of other whole files are named after their file below.
    first: dict[str, TrialSpec] = {}
    for spec in campaign.specs:
        first.setdefault(spec.scenario.name, spec)
    for spec in first.values():
        scenario, name = spec.scenario, file_name(spec.scenario.name)
        texts[f"scenarios/{name}.yaml"] = _dump(scenario.model_dump(mode="json", exclude={"name"}))
        if scenario.files:
            texts[f"scenarios/{name}.maps.yaml"] = _dump(scenario.file_hashes)
        texts[f"robots/{name}.yaml"] = _dump(spec.robot.model_dump(mode="json"))
    beside = {id(columns.setup.robot): columns.name for columns in campaign.nav2[1:]}
    for spec in campaign.specs:
        if spec.trial == 0 and (alias := beside.get(id(spec.preset.stack))):
            name = f"robots/{file_name(spec.scenario.name)}.{file_name(alias)}.yaml"
            texts.setdefault(name, _dump(spec.robot.model_dump(mode="json")))
    for preset in campaign.presets:
        texts[f"controllers/{file_name(preset.name)}.yaml"] = as_yaml(preset)
        if hashes := preset.file_hashes:
            texts[f"controllers/{file_name(preset.name)}.files.yaml"] = _dump(hashes)
    for columns in campaign.nav2:
        suffix = f"_{file_name(columns.name)}" if len(campaign.nav2) > 1 else ""
        texts[f"nav2_robot{suffix}.yaml"] = columns.setup.robot_file()
        texts[f"nav2_check{suffix}.txt"] = columns.setup.check.as_text() + "\n"
    if len(campaign.nav2) > 1:
        lines = difference_lines(campaign.nav2, differences(campaign.nav2))
        texts["nav2_differences.txt"] = "\n".join(lines) + "\n"
    return texts


def _dump(data: dict[str, Any]) -> str:
    return dump_yaml(data, sort_keys=False)


def _hashes(inputs: dict[str, str]) -> dict[str, str]:
    return {name: sha256(text.encode()).hexdigest() for name, text in inputs.items()}
