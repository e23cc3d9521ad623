"""The documentation says what the code does."""

from pathlib import Path

import pytest

from drake_navbench.inputs.presets import load_preset, preset_files

REPOSITORY = Path(__file__).parents[1]
CONTROLLERS_TEXT = (REPOSITORY / "docs" / "controllers.md").read_text(encoding="utf-8")


def built_in_presets():
    """Returns the names of the presets in controllers/*/presets."""
    return sorted(path.stem for path in (REPOSITORY / "controllers").glob("*/presets/*.yaml"))


def preset_row(name):
    preset = load_preset(name)
    return f"| `{name}` | `{preset.controller}` | {preset.description} |"


def test_every_preset_of_the_built_in_controllers_is_installed():
    assert set(built_in_presets()) <= set(preset_files())


@pytest.mark.parametrize("name", built_in_presets())
def test_table_of_presets_has_the_line_of_every_preset_file(name):
    assert preset_row(name) in CONTROLLERS_TEXT.splitlines()


def test_table_of_presets_lists_no_others():
    rows = [line for line in CONTROLLERS_TEXT.splitlines() if line.startswith("| `")]
    assert rows == [preset_row(name) for name in built_in_presets()]
