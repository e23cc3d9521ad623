"""`--original BUILD`: beside each column the original of its controller."""

from __future__ import annotations

import pytest
from nav2_setups import read_nav2_files

from drake_navbench.campaign.request_arguments import request_from_arguments
from drake_navbench.commands.command_line import EXIT_WRONG_INPUT
from drake_navbench.commands.run import build_parser, main
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.originals_beside import with_originals
from drake_navbench.inputs.robot import load_robot
from drake_navbench.trial.trial import simulate

GRACEFUL = "nav2_graceful_controller::GracefulController"
FILE = f"""
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath, Other]
    FollowPath: {{plugin: {GRACEFUL}, max_lookahead: 0.5, speed: 0.25, "block.depth": 2}}
    Other: {{plugin: {GRACEFUL}, k_phi: 1.5}}
"""


def names(columns):
    return [column if isinstance(column, str) else column.name for column in columns]


def test_each_column_is_followed_by_its_original_with_the_columns_parameters(tiny):
    columns = with_originals(["graceful:max_lookahead=0.5", "graceful"], "tiny")
    assert names(columns) == [
        "graceful:max_lookahead=0.5",
        "graceful@tiny:max_lookahead=0.5",
        "graceful",
        "graceful@tiny",
    ]
    client = columns[1].parameters.client
    assert client["plugin"] == GRACEFUL
    assert client["parameters"]["max_lookahead"] == 0.5


def test_a_column_that_has_no_original_drives_alone(tiny):
    with pytest.warns(
        InputWarning, match="dwb@tiny: .* is not in the build.*; this column drives without"
    ):
        assert names(with_originals(["graceful", "dwb"], "tiny")) == [
            "graceful",
            "graceful@tiny",
            "dwb",
        ]


def test_an_original_that_is_asked_for_by_name_is_no_second_time_there(tiny):
    asked = ["graceful@tiny", "graceful"]
    assert with_originals(asked, "tiny") == asked


def test_where_no_column_has_one_it_is_wrong_input(tiny):
    with pytest.raises(
        InputError, match=r"--original tiny: no column has an original: .*harmony@tiny"
    ):
        with_originals(["harmony"], "tiny")


def test_a_column_that_is_not_known_is_told_as_without_originals(tiny):
    with pytest.raises(InputError, match=r"^controller 'gracefull' is not known; did you mean"):
        with_originals(["graceful", "gracefull"], "tiny")


def test_the_original_is_given_all_that_a_nav2_file_says(tiny, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(FILE, encoding="utf-8")
    setup = read_nav2_files([path], load_robot("wheelchair"), "wheelchair")
    columns = with_originals(setup.presets, "tiny")
    assert names(columns)[:2] == ["mine/FollowPath", "mine/FollowPath@tiny"]
    port, original, _, other = columns
    # Of which the port knows the first alone.
    told = {"max_lookahead": 0.5, "speed": 0.25, "block": {"depth": 2}}
    assert original.parameters.client["parameters"] == told
    assert "speed" not in port.values
    assert other.parameters.client["parameters"] == {"k_phi": 1.5}


@pytest.mark.filterwarnings("ignore:.* does not read")
def test_both_are_columns_of_a_run(tiny, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(FILE, encoding="utf-8")
    task = tmp_path / "short.yaml"
    task.write_text("description: short\ngoal: [2.0, 0.0, 0.0]\ntimeout_s: 0.5\n", encoding="utf-8")
    asked = [str(task), "--nav2", str(path), "--original", "tiny", "--trials", "1"]
    campaign = request_from_arguments(build_parser().parse_args(asked)).campaign()
    assert campaign.columns == [
        "mine/FollowPath",
        "mine/FollowPath@tiny",
        "mine/Other",
        "mine/Other@tiny",
    ]
    original = next(s for s in campaign.specs if s.preset.name == "mine/FollowPath@tiny")
    # It drives straight on at the speed that the file gives it.
    assert simulate(original).samples.command_v_mps.max() == 0.25


def test_a_build_that_is_not_there_is_one_line(builds, capsys):
    assert main(["empty", "--original", "nowhere"]) == EXIT_WRONG_INPUT
    shown = capsys.readouterr().err
    assert shown.startswith("build 'nowhere' is not known")
    assert shown.count("\n") == 1
