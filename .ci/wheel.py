"""Makes a wheel for this platform and Python that brings compiled kernels: `make wheel`.

Copies the tracked files, compiles the kernels of all built-in columns and scenarios into the copy,
and builds it. An installation drives at once where numba, llvmlite and the instruction set are
those of this environment; elsewhere it compiles as any other, and says so. Leaves the wheel in
dist/. `--columns rpp,dwb` and `--scenarios empty` leave the others out.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]
OUT = REPOSITORY / "dist"


def copy_tracked(repository: Path, target: Path) -> None:
    """Copies the files of a repository that git knows."""
    command = ["git", "-C", str(repository), "ls-files", "-z"]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if (repository / name).is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(repository / name, target / name)


def compile_into(folder: Path, columns: list[str], scenarios: list[str], jobs: int) -> None:
    """Compiles kernels into an empty folder; this process must not have imported numba yet."""
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    from drake_navbench.campaign import compiled_kernels

    compiled_kernels.compile_into(folder, columns, scenarios, jobs=jobs)


def build(source: Path, out: Path) -> Path:
    """Returns the wheel of a folder, tagged for this Python and platform."""
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    (source / "setup.cfg").write_text(
        f"[bdist_wheel]\npython_tag = {python}\nplat_name = {platform}\n", encoding="utf-8"
    )
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps"]
    command += ["--no-build-isolation", "--wheel-dir", str(out), str(source)]
    subprocess.run(command, check=True)
    (wheel,) = out.glob(f"*-{python}-none-{platform}.whl")
    return wheel


def main() -> None:
    """Makes the wheel."""
    parser = argparse.ArgumentParser(description="Makes a wheel with compiled kernels.")
    parser.add_argument("--columns", default="", help="built-in columns, separated by commas")
    parser.add_argument("--scenarios", default="", help="built-in scenarios, separated by commas")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    columns, scenarios = (
        [name.strip() for name in text.split(",") if name.strip()]
        for text in (arguments.columns, arguments.scenarios)
    )
    with tempfile.TemporaryDirectory() as name:
        source = Path(name, "source")
        copy_tracked(REPOSITORY, source)
        # As in the package, where an installation looks for it.
        folder = source / "drake_navbench" / "compiled_kernels"
        folder.mkdir()
        compile_into(folder, columns, scenarios, arguments.jobs)
        built = build(source, Path(name, "wheel"))
        OUT.mkdir(exist_ok=True)
        shutil.copyfile(built, OUT / built.name)
    size_mb = (OUT / built.name).stat().st_size / 1e6
    print(f"dist/{built.name}, {size_mb:.0f} MB")


if __name__ == "__main__":
    main()
