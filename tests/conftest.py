"""Settings of the whole test suite, and what many tests need."""

from __future__ import annotations

import fcntl
import gc
import json
import os
import shutil
import signal
import sys
import tempfile
import textwrap
import tomllib
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import wraps
from importlib import import_module
from multiprocessing import forkserver
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from worker_here import working_apart, working_here

from drake_navbench.campaign.warm_up import OBJECTS_BETWEEN_COLLECTIONS, PRELOAD_MODULE
from drake_navbench.plugins.kinds import forget_installed

# From an empty cache the tests compile for minutes, and the compiler's objects live on.
gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)

# Tables are as wide as in a pipe, also where tests run side by side, of which each is told a width.
os.environ.pop("COLUMNS", None)

# The first call of a kernel compiles it; that is no fault of the property under test.
settings.register_profile("no_deadline", deadline=None, derandomize=True, max_examples=30)
settings.load_profile("no_deadline")

# Modules with Drake or numba are named, not imported: the process that starts those that run the
# tests reads this file first, and they wait for it.
REHEARSAL = "drake_navbench.trial.rehearsal"
LIMITED_CALL = "drake_navbench.processes.limited_call"

AGG = "matplotlib.backends.backend_agg"
# A PNG of one pixel of 8 bits of grey, white.
PIXEL = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108000000003a7e9b55"
    "0000000a49444154789c63f80f0001010100b138f6140000000049454e44ae426082"
)

# Entry points of a package: group -> name -> value, such as "module:Class".
EntryPoints = Mapping[str, Mapping[str, str]]


# The number of this process among those that run tests side by side, such as 0 for gw0.
NUMBER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector) -> Iterator[None]:
    """Lets every second process begin with the last files.

    Each reads all of them, and what one has compiled by then, the tests and all that they import,
    the other finds on the disk.
    """
    report = yield
    if NUMBER % 2 and isinstance(collector, pytest.Dir):
        report.result.reverse()
    return report


def pytest_collection_modifyitems(items) -> None:
    """Gives the tests the one order that processes side by side have to agree upon."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        items.sort(key=lambda item: item.path.parts)


@pytest.fixture(scope="session", autouse=True)
def _no_rehearsals() -> Iterator[Callable[..., Any]]:
    """No trial is rehearsed in this process but where a test asks for `rehearsals`.

    A rehearsal keeps compute times free of what a process does once. Its result is thrown away, so
    it can make no other test fail, but it takes a quarter of a short trial.
    """
    scenes = import_module(REHEARSAL)._scenes
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(f"{REHEARSAL}._scenes", lambda spec: iter(()))
        yield scenes


@pytest.fixture
def rehearsals(_no_rehearsals, monkeypatch) -> None:
    """Trials are rehearsed as in a process that has rehearsed none before."""
    monkeypatch.setattr(f"{REHEARSAL}._scenes", _no_rehearsals)
    monkeypatch.setattr(f"{REHEARSAL}._rehearsed", set())


@pytest.fixture(scope="session", autouse=True)
def _blank_pngs() -> Iterator[Callable[..., Any]]:
    """A figure's PNG is one white pixel in this process but where a test asks for `real_pngs`.

    A report draws it of the figure that it has just drawn as SVG, in the same time once more.
    """
    agg = import_module(AGG).FigureCanvasAgg
    drawn = agg.print_png

    # matplotlib asks which options it takes.
    @wraps(drawn)
    def print_pixel(canvas: Any, file: Any, **options: Any) -> None:
        if isinstance(file, str | Path):
            Path(file).write_bytes(PIXEL)
        else:
            # A picture for a notebook, of no file.
            drawn(canvas, file, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(agg, "print_png", print_pixel)
        yield drawn


@pytest.fixture
def real_pngs(_blank_pngs, monkeypatch) -> None:
    """Figures are drawn as PNG, too."""
    monkeypatch.setattr(import_module(AGG).FigureCanvasAgg, "print_png", _blank_pngs)


@pytest.fixture(scope="session", autouse=True)
def _temporary_folder(tmp_path_factory) -> Iterator[None]:
    """What browsers, libraries and killed processes leave behind goes with the tests' folders."""
    folder = str(tmp_path_factory.mktemp("t"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TMPDIR", folder)
        patch.setattr(tempfile, "tempdir", folder)
        yield


@pytest.fixture(scope="session", autouse=True)
def _works_here() -> Iterator[None]:
    """Tasks of workers run in the tests' own process but where a test asks for `real_workers`.

    A worker is forked from a server that imports Drake; it loads kernels, and rehearses each column
    that it drives.
    """
    with working_here():
        yield


@pytest.fixture(scope="session")
def _one_server() -> Iterator[None]:
    """Real workers are forked from one server, which has loaded all that any of them needs.

    A process has one server for its whole life. Started by the first report it would have loaded
    no Drake, and each worker of a later campaign would import it anew.
    """
    forkserver.set_forkserver_preload([PRELOAD_MODULE])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(forkserver, "set_forkserver_preload", lambda modules: None)
        yield


@pytest.fixture(scope="module")
def real_workers(_works_here, _one_server) -> Iterator[None]:
    """Workers are processes, for a module whose tests look at how they begin or end."""
    with working_apart():
        yield


@pytest.fixture
def site_folder(tmp_path, monkeypatch) -> Iterator[Path]:
    """A folder in which packages are installed for one test."""
    monkeypatch.syspath_prepend(tmp_path)
    before = set(sys.modules)
    yield tmp_path
    packages = {path.name for path in tmp_path.iterdir()}
    for name in set(sys.modules) - before:
        if name.partition(".")[0] in packages:
            del sys.modules[name]
    forget_installed()


@pytest.fixture(scope="session", autouse=True)
def _calls_forked() -> Iterator[Callable[..., Any]]:
    """A limited call is made in a fork of this process but where a test asks for `real_children`.

    What the call imports is imported here, once, not in a new interpreter at each call.
    """
    limited = import_module(LIMITED_CALL)
    started = limited._answer_of_child

    def forked(
        function: str, argument: Any, folder: Path | None, memory_bytes: int, time_s: int
    ) -> Any:
        with suppress(ImportError):
            import_module(function.partition(":")[0])
        reader, writer = os.pipe()
        with warnings.catch_warnings():
            # Newer Pythons warn of the threads of libraries, which the child does not use.
            warnings.simplefilter("ignore", DeprecationWarning)
            child = os.fork()
        if child == 0:
            try:
                signal.alarm(time_s)
                os.chdir(folder or ".")
                with open(writer, "w", encoding="utf-8") as file:
                    file.write(limited._answer(function, json.dumps(argument)))
            finally:
                os._exit(0)
        os.close(writer)
        with open(reader, encoding="utf-8") as file:
            answer = file.read()
        os.waitpid(child, 0)
        return json.loads(answer)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(limited, "_answer_of_child", forked)
        yield started


@pytest.fixture(scope="session", autouse=True)
def _compiled_once(tmp_path_factory) -> Iterator[None]:
    """Of processes side by side one compiles a kernel; the others wait and read it from the cache.

    Who compiles a kernel compiles the kernels that it calls, and none of them calls it: processes
    never wait for each other in a circle.
    """
    if "PYTEST_XDIST_WORKER" not in os.environ:
        yield
        return
    dispatcher = import_module("numba.core.dispatcher").Dispatcher
    folder = tmp_path_factory.getbasetemp().parent / "compiling"
    folder.mkdir(exist_ok=True)
    compile_kernel, ours = dispatcher.compile, set()

    def compiled(kernel: Any, signature: Any) -> Any:
        name = f"{kernel.py_func.__module__}.{kernel.py_func.__qualname__}"
        # Other functions are kept nowhere; a kernel that calls itself is this process's already.
        if not name.startswith("drake_navbench.") or name in ours:
            return compile_kernel(kernel, signature)
        with open(folder / name, "w") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            ours.add(name)
            try:
                return compile_kernel(kernel, signature)
            finally:
                ours.remove(name)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dispatcher, "compile", compiled)
        yield


@pytest.fixture
def real_children(_calls_forked, monkeypatch) -> None:
    """Limited calls are made in new processes, with their bounds on memory and time."""
    monkeypatch.setattr(f"{LIMITED_CALL}._answer_of_child", _calls_forked)


@pytest.fixture
def install_package(site_folder) -> Callable[[str, str, EntryPoints], Path]:
    """A function that installs a package with plugins, as pip lays it out, for one test.

    It takes the package's name, the code of its module of the same name, and its entry points.
    """

    def install(package: str, code: str, entry_points: EntryPoints) -> Path:
        (site_folder / package).mkdir()
        module = site_folder / package / f"{package}.py"
        module.write_text(textwrap.dedent(code), encoding="utf-8")
        _register(site_folder, package, "1.0", entry_points)
        return site_folder / package

    return install


@pytest.fixture
def install_folder(site_folder) -> Callable[[Path], Path]:
    """A function that installs the package of a folder with a pyproject.toml, for one test.

    It returns the folder in which it is installed.
    """

    def install(folder: Path) -> Path:
        data = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))
        for package in data["tool"]["setuptools"]["packages"]:
            files = data["tool"]["setuptools"]["package-data"].get(package, [])
            for pattern in ("*.py", *files):
                for path in (folder / package).glob(pattern):
                    place = site_folder / path.relative_to(folder)
                    place.parent.mkdir(parents=True, exist_ok=True)
                    shutil.copyfile(path, place)
        project = data["project"]
        _register(site_folder, project["name"], project["version"], project["entry-points"])
        return site_folder

    return install


def _register(site_folder: Path, name: str, version: str, entry_points: EntryPoints) -> None:
    metadata = site_folder / f"{name.replace('-', '_')}-{version}.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    (metadata / "entry_points.txt").write_text(
        "".join(
            f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in points.items())
            for group, points in entry_points.items()
        )
    )
    forget_installed()
