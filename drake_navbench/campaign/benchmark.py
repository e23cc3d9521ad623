"""From what is asked for, in a shell or in Python, to a results folder and what is printed."""

from __future__ import annotations

import argparse
import platform
import tempfile
import time
from collections.abc import Sequence
from datetime import datetime
from hashlib import sha256
from importlib.metadata import version
from itertools import chain, count
from pathlib import Path
from typing import Any

import yaml
from pydantic import ConfigDict
from rich.console import Console

from drake_navbench import __version__
from drake_navbench.analysis.rank_changes import rank_changes
from drake_navbench.analysis.sweeps import SUCCEEDED, long_table, response_table
from drake_navbench.analysis.tables import scenario_table
from drake_navbench.analysis.totals import told_by_totals, totals
from drake_navbench.campaign.asked import request_from_arguments, short_form
from drake_navbench.campaign.campaign import DEFAULT_TRIALS, Campaign, plan_campaign
from drake_navbench.campaign.cluster import require_cluster
from drake_navbench.campaign.console import CampaignProgress, print_scenario, terminal
from drake_navbench.campaign.driving import Undriven, run_campaign
from drake_navbench.campaign.replays import write_replays
from drake_navbench.campaign.request import Request
from drake_navbench.campaign.run_results import Results
from drake_navbench.campaign.suite_console import print_rank_changes, print_totals
from drake_navbench.campaign.warm_up import (
    cold_columns,
    start_worker_server,
    warm_up,
    warm_up_planners,
)
from drake_navbench.errors import InputError, NavbenchError, printable
from drake_navbench.inputs.presets import Preset, as_yaml, resolved_parameters
from drake_navbench.log import Outcome
from drake_navbench.processes import cache_folder
from drake_navbench.processes.fingerprint import Fingerprint
from drake_navbench.processes.machine import available_cores, circumstances
from drake_navbench.results import (
    ResultsFolder,
    file_name,
    only_run_in,
    remove_unfinished,
    require_writable,
    write_text,
)
from drake_navbench.trial.trial import DEFAULT_ROBOT
from drake_navbench.typed_files.typed_yaml import FrozenModel, validate

PRINTED_IN_SWEEP = {SUCCEEDED: "share", "time_to_goal_s": "s", "min_clearance_m": "m"}
PACKAGES_IN_MANIFEST = ("drake", "numba", "numpy", "pandas", "pyarrow", "scipy")


class _Begun(FrozenModel):
    """What a manifest must tell of a run that is to be resumed."""

    model_config = ConfigDict(extra="ignore")

    request: Request
    inputs: dict[str, str]
    identity: str
    drake_navbench: str
    wall_clock_s: float = 0.0


def run_benchmark(
    scenarios: Sequence[str] = (),
    controllers: Sequence[str | Preset] = (),
    *,
    trials: int = DEFAULT_TRIALS,
    seed: int = 0,
    jobs: int | None = None,
    robot: str = DEFAULT_ROBOT,
    out: str | Path | None = None,
    sweeps: Sequence[str] = (),
    samples: int | None = None,
) -> Results:
    """Runs a benchmark and returns its trials: a table with the metrics, and their logs.

    The arguments are those of the command line. `out` keeps the logs in a new folder, of which
    `python -m drake_navbench.report` makes a report; `--resume` goes on with it unless a
    controller was a Preset, which a manifest cannot name. Raises InputError where one is wrong,
    NavbenchError where trials came to no end by something that they did not do.
    """
    out = None if out is None else Path(out).absolute()
    names = [c if isinstance(c, str) else c.name for c in controllers]
    asked = {
        "scenarios": list(scenarios),
        "controllers": names,
        "parameter_files": [],
        "trials": trials,
        "seed": seed,
        "robot": robot,
        "replay": "none",
        "sweeps": list(sweeps),
        "samples": samples,
    }
    request = validate(Request, asked, "run_benchmark")
    campaign = plan_campaign(
        scenarios,
        controllers,
        trials=trials,
        seed=seed,
        robot=robot,
        sweeps=sweeps,
        samples=samples,
    )
    temporary = tempfile.TemporaryDirectory() if out is None else None
    folder = ResultsFolder(out or Path(temporary.name if temporary else ""))
    with only_run_in(folder.path):
        require_writable(folder.path)
        jobs = jobs or available_cores()
        _begin(folder, campaign, request if names == list(controllers) else None, jobs)
        table, undriven, _ = run_campaign(campaign, folder, jobs=jobs)
    if undriven:
        raise NavbenchError("\n".join(map(_undriven_line, undriven)))
    return Results(table, folder.path, temporary)


def run_from_command_line(arguments: argparse.Namespace) -> bool:
    """Does what the command line asks; returns whether any trial ended in an error.

    Raises InputError, before anything is written, where the input is wrong.
    """
    console = terminal(quiet=arguments.quiet)
    resumed = arguments.resume is not None
    # A plugin may change the working directory; what is asked for is where it was asked from.
    path = (arguments.resume or arguments.out or default_results_path()).absolute()
    folder = ResultsFolder(path)
    if resumed:
        begun = validate(_Begun, folder.read_manifest(), str(folder.manifest_path))
        request = begun.request
        campaign = request.campaign()
        _require_same_inputs(folder, campaign, begun)
    else:
        request = request_from_arguments(arguments)
        campaign = request.campaign()
        require_writable(folder.path)
    if arguments.live:
        from drake_navbench.campaign.live import show_live

        return show_live(campaign, console)
    for preset in campaign.presets:
        if preset.ignored:
            ignored = ", ".join(preset.ignored)
            told = f"{preset.source}: has no use here and is ignored: {ignored}"
            console.print(printable(told))
    if campaign.nav2 is not None:
        for line in short_form(campaign.nav2):
            console.print(line, soft_wrap=True)
    jobs = arguments.jobs or available_cores()
    if arguments.cluster is not None:
        # That nobody answers is known before anything is written.
        require_cluster(arguments.cluster)
    try:
        with only_run_in(folder.path):
            if resumed:
                _complete(folder, campaign, jobs)
            else:
                require_writable(folder.path)
                _begin(folder, campaign, request, jobs)
            return _run(
                request, campaign, folder, jobs=jobs, console=console, cluster=arguments.cluster
            )
    except KeyboardInterrupt:
        console.print(
            f"Go on with: python -m drake_navbench.run --resume {folder.path}", soft_wrap=True
        )
        raise


def default_results_path() -> Path:
    """Returns results/<time>, with a number behind it where that exists already."""
    stem = datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
    paths = (
        Path("results") / f"{stem}{suffix}" for suffix in chain([""], map("_{}".format, count(2)))
    )
    return next(path for path in paths if not path.exists())


def _run(
    request: Request,
    campaign: Campaign,
    folder: ResultsFolder,
    *,
    jobs: int,
    console: Console,
    cluster: str | None = None,
) -> bool:
    if line := cache_folder.notice():
        console.print(line)
    if columns := cold_columns(campaign.specs):
        console.print("Compiling the kernels, once for this installation (up to a minute) ...")
        warm_up(columns, jobs=jobs)
    warm_up_planners(campaign.specs)
    started = time.perf_counter()
    start_worker_server()
    # The report and its figures take as long to import as the server of the workers to start.
    from drake_navbench.analysis.figures.album import FigureChoice
    from drake_navbench.analysis.report import build_report

    with CampaignProgress(console) as progress:
        trials, undriven, machines = run_campaign(
            campaign,
            folder,
            jobs=jobs,
            on_progress=progress.update,
            on_refused_log=_print_error,
            cluster=cluster,
            on_refused_worker=_print_error,
        )
    wall_s = time.perf_counter() - started
    _add_wall_clock(folder, wall_s)
    if machines:
        _add_cluster(folder, machines)
    for entry in undriven:
        _print_error(_undriven_line(entry))
    if undriven:
        _print_error(f"{len(undriven)} trials were not driven; --resume {folder.path} drives them")
    if trials.empty:
        return True
    impossible = {spec.scenario.name for spec in campaign.specs if spec.scenario.is_impossible}
    told = told_by_totals(campaign.suites)
    if campaign.sweep:
        for scenario, rows in long_table(trials, campaign.sweep).groupby("scenario", sort=False):
            print_scenario(console, response_table(rows, PRINTED_IN_SWEEP), str(scenario))
    else:
        for scenario in dict.fromkeys(trials["scenario"]):
            if scenario not in told:
                table = scenario_table(trials, scenario)
                print_scenario(console, table, scenario, is_impossible=scenario in impossible)
    print_totals(console, totals(trials))
    print_rank_changes(console, rank_changes(trials, campaign.clean_of))
    if request.replay == "each" or (request.replay == "race" and set(campaign.scenarios) - told):
        console.print("Writing the replays ...")
        left_out = told if request.replay == "race" else frozenset()
        failures = write_replays(
            folder, campaign, each=request.replay == "each", jobs=jobs, left_out=left_out
        )
        for scenario, reason in failures.items():
            _print_error(f"no replay: {scenario}: {reason}")
    console.print("Writing the report ...")
    build_report(
        folder.path,
        figures=FigureChoice(request.figures),
        jobs=jobs,
        measured=trials,
        parameters_of=resolved_parameters,
    )
    driven_s = float(trials["simulated_time_s"].sum())
    count = f"{len(trials)} trial{'s' if len(trials) > 1 else ''}"
    console.print(
        f"{count}, {driven_s:.0f} s of driving, in {wall_s:.0f} s. "
        f"Open {folder.path / ('sweep.html' if campaign.sweep else 'report.html')}"
    )
    errors = trials[trials["outcome"] == Outcome.ERROR]
    for row in errors.itertuples():
        where = f"{row.scenario}, {row.controller}, trial {row.trial}"
        _print_error(f"error: {where}: {row.reason}")
    return bool(undriven) or not errors.empty


def _undriven_line(entry: Undriven) -> str:
    spec = entry.spec
    where = f"{spec.scenario.name}, {spec.preset.name}, trial {spec.trial}"
    return f"not driven: {where}: {entry.reason}"


def _print_error(text: str) -> None:
    """Prints a line that may hold anything, as it is, however quiet the run is."""
    terminal(stderr=True).print(text, soft_wrap=True)


def _add_wall_clock(folder: ResultsFolder, wall_s: float) -> None:
    """Adds the time that the trials took to the manifest; a resumed run took both times."""
    manifest = folder.read_manifest()
    manifest["wall_clock_s"] = manifest.get("wall_clock_s", 0.0) + wall_s
    folder.write_manifest(manifest)


def _add_cluster(folder: ResultsFolder, machines: Sequence[tuple[Fingerprint, int]]) -> None:
    """Adds to the manifest who drove how many trials; warns where processors differ.

    Compiled kernels round as the processor does: only trials of equal ones are equal to the bit.
    """
    manifest = folder.read_manifest()
    driven = [{"trials": count, **found._asdict()} for found, count in machines]
    manifest["cluster"] = [*manifest.get("cluster", []), *driven]
    folder.write_manifest(manifest)
    kinds = {entry["features"]: entry["processor"] for entry in manifest["cluster"]}
    if len(kinds) > 1:
        _print_error(
            f"driven on {len(kinds)} kinds of processors, which may round differently: "
            f"{', '.join(kinds.values())}; manifest.json tells"
        )


def _begin(folder: ResultsFolder, campaign: Campaign, request: Request | None, jobs: int) -> None:
    """Writes the manifest and the resolved inputs; without a request it cannot be resumed."""
    inputs = _inputs(campaign)
    remove_unfinished(folder.path)
    asked = {} if request is None else {"request": request.model_dump(mode="json")}
    machines = {"machines": [circumstances(jobs)]}
    folder.write_manifest(asked | machines | _manifest(campaign, inputs))
    _write_inputs(folder, inputs)


def _complete(folder: ResultsFolder, campaign: Campaign, jobs: int) -> None:
    """Makes up for what the end of a run, at any moment, may have kept it from writing.

    The manifest tells of every machine, or number of workers, with which the run went on.
    """
    remove_unfinished(folder.path)
    manifest = folder.read_manifest()
    manifest["machines"] = [*manifest.get("machines", []), circumstances(jobs)]
    folder.write_manifest(manifest)
    _write_inputs(folder, _inputs(campaign))


def _write_inputs(folder: ResultsFolder, inputs: dict[str, str]) -> None:
    for name, text in inputs.items():
        write_text(folder.path / "inputs" / name, text)


def _manifest(campaign: Campaign, inputs: dict[str, str]) -> dict[str, Any]:
    nav2 = campaign.nav2
    own = {} if nav2 is None else {name: nav2.stand_ins_of(name) for name in campaign.columns}
    return {
        "stand_ins": [] if nav2 is None else nav2.stand_ins_of_all(),
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


def _inputs(campaign: Campaign) -> dict[str, str]:
    """Returns every resolved input file of a campaign: name in inputs/ -> text.

    Of maps and masks, and of files that controllers consist of or read, there are hashes only.
    """
    texts = {}
    for spec in {spec.scenario.name: spec for spec in campaign.specs}.values():
        scenario, name = spec.scenario, file_name(spec.scenario.name)
        texts[f"scenarios/{name}.yaml"] = _dump(scenario.model_dump(mode="json", exclude={"name"}))
        if scenario.files:
            texts[f"scenarios/{name}.maps.yaml"] = _dump(scenario.file_hashes)
        texts[f"robots/{name}.yaml"] = _dump(spec.robot.model_dump(mode="json"))
    for preset in campaign.presets:
        texts[f"controllers/{file_name(preset.name)}.yaml"] = as_yaml(preset)
        if hashes := preset.file_hashes:
            texts[f"controllers/{file_name(preset.name)}.files.yaml"] = _dump(hashes)
    if campaign.nav2 is not None:
        texts["nav2_robot.yaml"] = campaign.nav2.robot_file()
        texts["nav2_check.txt"] = campaign.nav2.check.as_text() + "\n"
    return texts


def _dump(data: dict[str, Any]) -> str:
    return yaml.safe_dump(data, sort_keys=False)


def _hashes(inputs: dict[str, str]) -> dict[str, str]:
    return {name: sha256(text.encode()).hexdigest() for name, text in inputs.items()}


def _require_same_inputs(folder: ResultsFolder, campaign: Campaign, begun: _Begun) -> None:
    for name, digest in _hashes(_inputs(campaign)).items():
        if begun.inputs.get(name) != digest:
            raise InputError(
                f"--resume {folder.path}: inputs/{name} is no longer what the run began with; "
                "expected unchanged scenarios, robots and parameters"
            )
    if begun.drake_navbench != __version__:
        raise InputError(
            f"--resume {folder.path}: begun with version {begun.drake_navbench}, "
            f"this is {__version__}"
        )
    if begun.identity != campaign.identity:
        raise InputError(f"--resume {folder.path}: its trials are no longer those that it began")
