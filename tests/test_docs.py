"""The documentation says what the code does."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from drake_navbench.__main__ import main
from drake_navbench.commands.documentation import TABLE_BEGIN, documents, presets_table
from drake_navbench.inputs.presets import preset_files

REPOSITORY = Path(__file__).parents[1]
DOCS = REPOSITORY / "docs"
GENERATED = dict(documents(DOCS))


def built_in_presets():
    """Returns the names of the presets in controllers/*/presets."""
    return sorted(path.stem for path in (REPOSITORY / "controllers").glob("*/presets/*.yaml"))


@pytest.mark.parametrize("name", GENERATED)
def test_a_generated_file_is_what_make_docs_makes(name):
    assert (DOCS / name).read_text(encoding="utf-8") == GENERATED[name], "run `make docs`"


def test_every_schema_and_page_that_is_generated_is_named_as_such():
    assert {path.name for path in (DOCS / "schemas").glob("*")} == {
        Path(name).name for name in GENERATED if name.startswith("schemas/")
    }


def test_a_second_picture_of_the_wiring_in_one_process_has_the_same_bytes():
    assert dict(documents(DOCS))["wiring.dot"] == GENERATED["wiring.dot"]


def test_the_table_of_presets_has_a_line_for_every_preset_file():
    named = re.findall(r"^\| `(\w+)` \|", presets_table(), re.M)
    assert named == built_in_presets()
    assert set(named) <= set(preset_files())


def test_a_page_without_a_place_for_the_table_is_told(tmp_path, capsys):
    (tmp_path / "controllers.md").write_text("# Controllers\n")
    assert main(["docs", str(tmp_path)]) == 2
    assert f"controllers.md: expected the lines {TABLE_BEGIN!r}" in capsys.readouterr().err


def test_the_python_example_of_the_readme_runs_as_a_script_as_it_is_printed(tmp_path):
    (example,) = re.findall(r"```python\n(.*?)```", (REPOSITORY / "README.md").read_text(), re.S)
    script = tmp_path / "example.py"
    script.write_text(f"{example}print(repr(log), len(results.trials))\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"TrialLog\(scenario=static_obstacles, .*\) 8\n", done.stdout)
