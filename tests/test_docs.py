"""The documentation says what the code does."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest
from documents import (
    TABLE_BEGIN,
    TABLES,
    documents,
    main,
    presets_table,
    scenarios_table,
)
from field_table import NOT_IN_FILES
from plugin_page import DATA_FILE, ShippedPlugin, plugin_page, read_plugins

from drake_navbench.controller import CONTROLLERS
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.inputs.presets import preset_files
from drake_navbench.inputs.robot import Robot
from drake_navbench.navigation.costmaps.layer_plugin import COSTMAP_LAYERS
from drake_navbench.plugins.kinds import is_ours

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


# What is made for other places: the front page of the package.
ELSEWHERE = {"README.md", "package.md"}


@pytest.mark.parametrize(
    "page", sorted(path.name for path in DOCS.glob("*.*") if path.suffix in (".md", ".ipynb"))
)
def test_every_page_is_in_the_index(page):
    assert page in ELSEWHERE or f"]({page})" in (DOCS / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [*SCENARIO_FILES.names, *preset_files(), "robots"])
def test_the_gallery_has_a_picture_of_everything_that_ships(name):
    shown = f"images/gallery/{name}.svg"
    assert f"![{name}]({shown})" in (DOCS / "gallery.md").read_text(encoding="utf-8")
    assert (DOCS / shown).is_file(), f"run `python studies/gallery.py {name}`"


def test_a_second_picture_of_the_wiring_in_one_process_has_the_same_bytes():
    assert dict(documents(DOCS))["wiring.dot"] == GENERATED["wiring.dot"]


def test_the_table_of_presets_has_a_line_for_every_preset_file():
    named = re.findall(r"^\| `(\w+)` \|", presets_table(), re.M)
    assert named == built_in_presets()
    assert set(named) <= set(preset_files())


def test_the_table_of_scenarios_has_a_line_for_every_scenario_and_its_family():
    rows = dict(re.findall(r"^\| `(\w+)` \| .+ \| (.*) \|$", scenarios_table(), re.M))
    assert sorted(rows) == sorted(SCENARIO_FILES.names)
    assert rows["empty"] == "[published](#the-published-five)"
    assert rows["crossing"] == rows["ward_crowd"] == "[living world](living_world.md)"
    assert rows["everyday"] == rows["kidnapped"] == "[stress](stress.md)"
    assert rows["two_floors"] == "[missions](missions.md)"
    assert rows["doorway"] == ""


def test_the_pages_of_robots_have_every_field_and_a_block_like_another_names_it():
    page = GENERATED["robots.md"] + GENERATED["robot_navigation.md"]
    first_cells = re.findall(r"^\| (`[\w.]+`.*?) \|", page, re.M)
    parts = {
        part
        for cell in first_cells
        for name in re.findall(r"`([\w.]+)`", cell)
        for part in name.split(".")
    }
    parts |= {
        part for name in re.findall(r"^## `([\w.]+)`", page, re.M) for part in name.split(".")
    }
    schema = Robot.model_json_schema()
    known = {name for block in schema["$defs"].values() for name in block.get("properties", {})}
    chosen = {"plugin"}
    assert {*schema["properties"], *known} - parts == {*NOT_IN_FILES, *chosen}
    here = page.partition("## `navigation.local_costmap`")[2].partition("## ")[0]
    assert "| Nav2's voxel layer. Fields of `navigation.local_costmap.obstacle_layer`. |" in here
    assert "| `voxel_layer`: `z_voxels` (`10`), `origin_z` (`0.0`), " in here
    assert "`voxel_layer.marking`" not in here


def test_a_field_with_nav2s_name_and_meaning_is_listed_and_one_that_differs_is_explained():
    page = GENERATED["robot_navigation.md"]
    planner = page.partition("## `navigation.planner`")[2].partition("## ")[0]
    (row,) = [line for line in planner.splitlines() if "`w_euc_cost`" in line]
    assert row.endswith("| As in Nav2. |")
    assert "`w_euc_cost` (`1.0`)" in row
    assert "| `use_cell_centres` (`true`) | Ours: " in planner


@pytest.mark.parametrize("name", TABLES)
def test_a_page_without_a_place_for_the_table_is_told(name, tmp_path, capsys):
    (tmp_path / name).write_text("# A page\n")
    assert main([str(tmp_path)]) == 2
    first = TABLE_BEGIN.format(TABLES[name][0])
    assert f"{name}: expected the lines {first!r}" in capsys.readouterr().err


def test_the_python_example_of_the_readme_runs_as_a_script(tmp_path):
    (example,) = re.findall(r"```python\n(.*?)```", (REPOSITORY / "README.md").read_text(), re.S)
    # A trial of one controller is enough.
    short = example.replace('["rpp", "dwb"])', '["rpp"], trials=1)')
    assert short != example
    script = tmp_path / "example.py"
    script.write_text(f"{short}print(repr(log), len(results.trials))\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"TrialLog\(scenario=static_obstacles, .*\) 1\n", done.stdout)


SHIPPED = read_plugins(DOCS / DATA_FILE)
EVERY_PLUGIN = [plugin for sort in SHIPPED.kinds for plugin in sort.plugins]


def built_in(group):
    """Returns the names that our own package registers in a group of entry points."""
    return {point.name for point in entry_points(group=group) if is_ours(point.module)}


# Controllers that no Nav2 file names: hosts of what is somebody's own, a second port of TEB, and
# one that was made here.
OURS_ALONE = {"external", "harmony", "learned", "live", "teb_upstream"}
# Metrics are no plugins of a robot's navigation.
GROUPS = {name for name in entry_points().groups if name.startswith("drake_navbench.")}


@pytest.mark.parametrize("group", sorted(GROUPS - {"drake_navbench.metrics"}))
def test_every_plugin_of_ours_stands_in_the_table_of_nav2s(group):
    named = {plugin.ours for plugin in EVERY_PLUGIN}
    assert built_in(group) - OURS_ALONE <= named


def test_the_table_of_nav2s_plugins_says_that_every_costmap_layer_of_ours_is_here():
    here = {plugin.type for plugin in EVERY_PLUGIN if plugin.ours is not None}
    assert {name for name in COSTMAP_LAYERS.names if name.startswith("nav2_")} <= here


def test_the_table_of_nav2s_plugins_names_no_type_twice_and_every_type_that_the_code_names():
    types = [plugin.type for sort in SHIPPED.kinds for plugin in sort.plugins]
    by_kind = [(sort.kind, plugin.type) for sort in SHIPPED.kinds for plugin in sort.plugins]
    assert len(set(by_kind)) == len(by_kind)
    code = "".join(
        path.read_text(encoding="utf-8")
        for folder in ("drake_navbench", "controllers")
        for path in (REPOSITORY / folder).rglob("*.py")
    )
    found = set(re.findall(r'"((?:nav2_\w+|dwb_\w+|mppi)::\w+)"', code))
    assert found - set(types) == set()


def test_a_plugin_of_ours_says_whose_rules_it_follows_and_one_that_is_not_only_why():
    for plugin in EVERY_PLUGIN:
        assert (plugin.ours is None) is (plugin.release is None), plugin.type
        assert plugin.ours is not None or plugin.equal is None, plugin.type
        assert plugin.ours is None or plugin.remark is None, plugin.type


def test_the_controllers_of_the_table_are_selected_by_the_types_beside_them():
    (controllers,) = (sort for sort in SHIPPED.kinds if sort.kind == "Controllers")
    by_type = {plugin.type: plugin.ours for plugin in controllers.plugins}
    for name in built_in("drake_navbench.controllers") - OURS_ALONE:
        assert by_type[CONTROLLERS.load(name).nav2_plugin] == name


def test_plugins_of_which_the_same_is_said_share_a_row():
    page = GENERATED["plugins_of_nav2.md"]
    (row,) = [line for line in page.splitlines() if "`PipelineSequence`" in line]
    assert row.startswith("| `PipelineSequence`, `RecoveryNode`, `RoundRobin` | all | same name |")


def test_releases_are_told_in_few_words():
    def shown(**fields):
        page = plugin_page(
            SHIPPED.model_copy(
                update={
                    "kinds": [
                        SHIPPED.kinds[0].model_copy(
                            update={"plugins": [ShippedPlugin(type="a::B", **fields)]}
                        )
                    ]
                }
            )
        )
        return re.search(r"\| `a::B` \| ([^|]*) \|", page)[1]

    assert shown() == "all"
    assert shown(since="jazzy") == "from jazzy"
    assert shown(since="lyrical") == "lyrical"
    assert shown(until="iron") == "humble, iron"
    assert shown(but=["iron"]) == "humble, jazzy, kilted, lyrical"


def test_the_readme_is_read_in_five_minutes():
    assert len((REPOSITORY / "README.md").read_text(encoding="utf-8").splitlines()) <= 100
