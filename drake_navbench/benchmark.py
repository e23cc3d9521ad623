"""From parsed arguments to a finished results folder: trials, tables, replays, what is printed."""

from __future__ import annotations

import argparse
import platform
import time
from dataclasses import asdict, dataclass
from datetime import datetime
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

import yaml
from rich.console import Console

from drake_navbench import __version__
from drake_navbench.analysis.tables import scenario_table, table_to_markdown
from drake_navbench.campaign import Campaign, available_jobs, plan_campaign, run_campaign
from drake_navbench.errors import InputError
from drake_navbench.log import Outcome
from drake_navbench.presets import Preset, as_yaml, load_parameter_file
from drake_navbench.progress import CampaignProgress, print_scenario
from drake_navbench.replays import write_replays
from drake_navbench.results import ResultsFolder, file_name, require_writable, write_text
from drake_navbench.terminal import terminal
from drake_navbench.warm_up import kernels_are_cold, start_worker_server, warm_up

PACKAGES_IN_MANIFEST = ("drake", "numba", "numpy", "pandas", "pyarrow", "scipy")


@dataclass(frozen=True)
class Request:
    """What was asked for; it is kept in the manifest, so that a run can be resumed.

    controllers: presets and variants by name. parameter_files: more columns, from files.
    """

    scenarios: tuple[str, ...]
    controllers: tuple[str, ...]
    parameter_files: tuple[str, ...]
    trials: int
    seed: int
    robot: str
    replay: str

    def campaign(self) -> Campaign:
        """Returns the trials of this request, all input checked; raises InputError."""
        presets: list[str | Preset] = list(self.controllers)
        for path in self.parameter_files:
            presets += load_parameter_file(Path(path))
        return plan_campaign(
            self.scenarios,
            presets,
            trials=self.trials,
            seed=self.seed,
            robot=self.robot,
            wants_diagnostics=self.replay == "each",
        )


def run_from_command_line(arguments: argparse.Namespace) -> bool:
    """Does what the command line asks; returns whether any trial ended in an error.

    Raises InputError, before anything is written, where the input is wrong.
    """
    console = terminal(quiet=arguments.quiet)
    resumed = arguments.resume is not None
    if resumed:
        folder = ResultsFolder(arguments.resume)
        request = _request_from_manifest(folder)
        campaign = request.campaign()
        _require_same_inputs(folder, campaign)
    else:
        request = _request_from_arguments(arguments)
        campaign = request.campaign()
        folder = ResultsFolder(arguments.out or default_results_path())
        require_writable(folder.path)
    if arguments.live:
        from drake_navbench.live import show_live

        return show_live(campaign, console)
    for preset in {spec.preset.name: spec.preset for spec in campaign.specs}.values():
        if preset.ignored:
            console.print(
                f"{preset.source}: {preset.name}: has no use here and is ignored: "
                f"{', '.join(preset.ignored)}"
            )
    if not resumed:
        folder.write_manifest(_manifest(request, campaign))
        _write_inputs(folder, campaign)
    jobs = arguments.jobs or available_jobs()
    try:
        return _run(request, campaign, folder, jobs=jobs, console=console)
    except KeyboardInterrupt:
        console.print(
            f"Go on with: python -m drake_navbench.run --resume {folder.path}", soft_wrap=True
        )
        raise


def default_results_path() -> Path:
    """Returns results/<time>."""
    return Path("results") / datetime.now().strftime("%Y-%m-%d_%H-%M-%S")


def _request_from_arguments(arguments: argparse.Namespace) -> Request:
    listed = arguments.controllers.split(",") if arguments.controllers else []
    return Request(
        scenarios=tuple(arguments.scenarios),
        controllers=tuple(name.strip() for name in listed if name.strip()),
        parameter_files=tuple(str(path) for path in arguments.params),
        trials=arguments.trials,
        seed=arguments.seed,
        robot=arguments.robot,
        replay=arguments.replay,
    )


def _request_from_manifest(folder: ResultsFolder) -> Request:
    asked = folder.read_manifest()["request"]
    return Request(**{k: tuple(v) if isinstance(v, list) else v for k, v in asked.items()})


def _run(
    request: Request, campaign: Campaign, folder: ResultsFolder, *, jobs: int, console: Console
) -> bool:
    if kernels_are_cold():
        console.print("Compiling the kernels, once for this installation (about half a minute) ...")
        warm_up()
    started = time.perf_counter()
    start_worker_server()
    # The report and its figures take as long to import as the server of the workers to start.
    from drake_navbench.analysis.report import build_report

    with CampaignProgress(console) as progress:
        trials = run_campaign(campaign, folder, jobs=jobs, on_progress=progress.update)
    wall_s = time.perf_counter() - started
    _add_wall_clock(folder, wall_s)
    for scenario in campaign.scenarios:
        table = scenario_table(trials, scenario)
        write_text(folder.table_path(scenario, ".csv"), table.to_csv())
        write_text(folder.table_path(scenario, ".md"), table_to_markdown(table))
        print_scenario(console, table, scenario)
    if request.replay != "none":
        console.print("Writing the replays ...")
        write_replays(folder, campaign, each=request.replay == "each", jobs=jobs)
    console.print("Writing the report ...")
    build_report(folder.path, jobs=jobs)
    driven_s = float(trials["simulated_time_s"].sum())
    console.print(
        f"{len(trials)} trials, {driven_s:.0f} s of driving, in {wall_s:.0f} s. "
        f"Open {folder.path / 'report.html'}"
    )
    errors = trials[trials["outcome"] == Outcome.ERROR]
    for row in errors.itertuples():
        console.print(f"error: {row.scenario}, {row.controller}, trial {row.trial}: {row.reason}")
    return not errors.empty


def _add_wall_clock(folder: ResultsFolder, wall_s: float) -> None:
    """Adds the time that the trials took to the manifest; a resumed run took both times."""
    manifest = folder.read_manifest()
    manifest["wall_clock_s"] = manifest.get("wall_clock_s", 0.0) + wall_s
    folder.write_manifest(manifest)


def _manifest(request: Request, campaign: Campaign) -> dict[str, Any]:
    return {
        "request": asdict(request),
        "scenarios": campaign.scenarios,
        "controllers": campaign.columns,
        "inputs": _input_hashes(campaign),
        "drake_navbench": __version__,
        "python": platform.python_version(),
        "packages": {name: version(name) for name in PACKAGES_IN_MANIFEST},
        "platform": f"{platform.system()} {platform.machine()}",
        "created": datetime.now().astimezone().isoformat(timespec="seconds"),
    }


def _inputs(campaign: Campaign) -> dict[str, str]:
    """Returns every resolved input file of a campaign: name in inputs/ -> text.

    Of maps and masks there are hashes only.
    """
    texts = {}
    for spec in campaign.specs:
        scenario, preset = spec.scenario, spec.preset
        name = file_name(scenario.name)
        texts[f"scenarios/{name}.yaml"] = _dump(scenario.model_dump(mode="json", exclude={"name"}))
        if scenario.files:
            hashes = {str(path): sha256(path.read_bytes()).hexdigest() for path in scenario.files}
            texts[f"scenarios/{name}.maps.yaml"] = _dump(hashes)
        texts[f"robots/{name}.yaml"] = _dump(spec.robot.model_dump(mode="json"))
        texts[f"controllers/{file_name(preset.name)}.yaml"] = as_yaml(preset)
    return texts


def _dump(data: dict[str, Any]) -> str:
    return yaml.safe_dump(data, sort_keys=False)


def _input_hashes(campaign: Campaign) -> dict[str, str]:
    return {name: sha256(text.encode()).hexdigest() for name, text in _inputs(campaign).items()}


def _write_inputs(folder: ResultsFolder, campaign: Campaign) -> None:
    for name, text in _inputs(campaign).items():
        write_text(folder.path / "inputs" / name, text)


def _require_same_inputs(folder: ResultsFolder, campaign: Campaign) -> None:
    manifest = folder.read_manifest()
    before = manifest["inputs"]
    for name, digest in _input_hashes(campaign).items():
        if before.get(name) != digest:
            raise InputError(
                f"--resume {folder.path}: inputs/{name} is no longer what the run began with; "
                "expected unchanged scenarios, robots and parameters"
            )
    if manifest["drake_navbench"] != __version__:
        raise InputError(
            f"--resume {folder.path}: begun with version {manifest['drake_navbench']}, "
            f"this is {__version__}"
        )
