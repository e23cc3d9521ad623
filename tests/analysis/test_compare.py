"""Comparing results folders: what got worse, how sure, and the exit status for CI."""

from __future__ import annotations

import shutil
from functools import cache
from xml.etree import ElementTree

import pytest
from results_folders import measured_folder, write_folder

from drake_navbench.analysis import compare, compare_files
from drake_navbench.analysis.compare import compare_folders
from drake_navbench.analysis.paired_tests import DEFAULT_LISTED, PairedVerdict
from drake_navbench.commands import compare as command
from drake_navbench.errors import InputError


@pytest.fixture(scope="module", autouse=True)
def _analysed_once():
    """A folder is analysed for the first comparison; none of them changes after it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compare, "analyse_folder", cache(compare.analyse_folder))
        yield


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Folders of three trials; in all but `wandering` nothing is random, so that they are one."""
    root = tmp_path_factory.mktemp("compared")

    def folder(name, **how):
        return measured_folder(root / name, **({"is_random": False} | how))

    return {
        "main": folder("main"),
        "slow": folder("slow", slower=1.1),
        "failing": folder("failing", failing=("rpp",)),
        "touching": folder("touching", failing=("rpp",), ending="collided"),
        "crashing": folder("crashing", failing=("rpp",), ending="error"),
        "wandering": folder("wandering", is_random=True),
    }


def compared(*paths, **kwargs):
    return compare_folders(paths, jobs=1, **kwargs)


def verdicts(comparison, metric):
    return {f.verdict for f in comparison.judged.findings if f.quantity.name == metric}


def test_the_same_results_are_equal_in_every_trial(folders):
    comparison = compared(folders["wandering"], folders["wandering"])
    found = {finding.verdict for finding in comparison.judged.findings}
    assert found == {PairedVerdict.EQUAL, PairedVerdict.NO_VALUE}
    # 2 scenarios, 2 controllers, 3 trials.
    assert (comparison.judged.equal, comparison.judged.pairs) == (12, 12)
    text = compare_files.to_markdown(comparison)
    assert "12 of 12 pairs of trials are equal in outcome and all metrics; equal in every" in text


def test_slower_is_worse_in_the_one_trial_that_there_is(folders):
    comparison = compared(folders["main"], folders["slow"])
    assert verdicts(comparison, "time_to_goal_s") == {PairedVerdict.WORSE}
    finding = next(f for f in comparison.regressions if f.controller == "rpp")
    # 3 m at 0.5 and at 0.4545 m/s: 6.0 and 6.6 s. Three equal trials are one.
    assert finding.comparison.difference == pytest.approx(0.6, abs=0.02)
    assert finding.comparison.pairs == 1
    assert finding.is_one_trial
    assert "count" in compare_files.to_markdown(comparison)


def test_three_random_trials_decide_nothing(folders, tmp_path):
    slow = measured_folder(tmp_path / "slow", slower=1.1)
    comparison = compared(folders["wandering"], slow)
    assert verdicts(comparison, "time_to_goal_s") == {PairedVerdict.UNDECIDED}
    assert comparison.regressions == []


def test_the_other_way_round_it_is_better_and_no_regression(folders):
    comparison = compared(folders["slow"], folders["main"])
    assert verdicts(comparison, "time_to_goal_s") == {PairedVerdict.BETTER}
    assert comparison.regressions == []


def test_only_listed_metrics_are_regressions(folders):
    listed = compared(folders["main"], folders["slow"], listed=["min_clearance_m"])
    assert listed.regressions == []
    assert PairedVerdict.WORSE in verdicts(listed, "time_to_goal_s")


def test_a_tolerance_lets_small_changes_pass(folders):
    comparison = compared(folders["main"], folders["slow"], tolerance=0.2)
    assert verdicts(comparison, "time_to_goal_s") == {PairedVerdict.SMALL}


@pytest.mark.parametrize(
    ("folder", "first"),
    [
        ("failing", "success_rate undecided: 100 -> 66.67 %"),
        ("touching", "touch_rate undecided: 0 -> 33.33 %"),
    ],
)
def test_a_loss_that_so_few_trials_cannot_decide_is_told_and_fails_nothing(
    folders, capsys, folder, first
):
    arguments = [str(folders["main"]), str(folders[folder]), "--jobs", "1", "--all"]
    assert command.main([*arguments, "--fail-on", "min_clearance_m"]) == 0
    shown = capsys.readouterr()
    lines = [line for line in shown.err.splitlines() if line.startswith("not decided: ")]
    assert lines[0].startswith(f"not decided: empty, rpp: {first}")
    assert "1 pair" not in lines[0]
    assert "a decision needs at least" in lines[0]
    assert "## Losses that so few trials do not decide" in shown.out


def test_a_trial_that_ends_as_an_error_is_named_and_a_regression(folders, capsys, tmp_path):
    junit = tmp_path / "junit.xml"
    arguments = [str(folders["main"]), str(folders["crashing"]), "--jobs", "1"]
    assert command.main([*arguments, "--junit", str(junit)]) == 1
    told = capsys.readouterr().err
    assert "regression: empty, rpp: 1 trial ended as an error, seed 33: no valid control" in told
    suite = ElementTree.parse(junit).getroot().find("testsuite")
    names = {case.attrib["name"] for case in suite if case.find("failure") is not None}
    assert names == {"seed 33"}
    assert int(suite.attrib["failures"]) == 2
    # Who had it before, too, did not get worse.
    assert command.main([str(folders["crashing"])] * 2 + ["--jobs", "1"]) == 0


def test_several_folders_are_each_compared_with_the_first_and_corrected_together(folders):
    comparison = compared(folders["main"], folders["slow"], folders["failing"])
    assert {finding.label for finding in comparison.judged.findings} == {
        str(folders["slow"]),
        str(folders["failing"]),
    }


def test_missing_trials_are_noted(folders, tmp_path):
    other = write_folder(tmp_path / "other")
    for path in other.glob("trials/empty/rpp/*.parquet"):
        path.unlink()
    (other / "trials" / "own_corridor" / "rpp" / "trial_001.parquet").write_bytes(b"PAR1")
    comparison = compared(folders["main"], other)
    assert any(n.startswith("empty / rpp: missing in") for n in comparison.not_compared)
    assert any("1 trial has no partner" in n for n in comparison.not_compared)
    assert "trial_001.parquet" in comparison.left_out[0].path


def test_the_command_exits_1_on_a_regression_and_writes_junit(folders, tmp_path, capsys):
    junit, markdown = tmp_path / "junit.xml", tmp_path / "compare.md"
    arguments = [str(folders["main"]), str(folders["slow"]), "--jobs", "1"]
    status = command.main([*arguments, "--junit", str(junit), "--markdown", str(markdown)])
    assert status == 1
    suite = ElementTree.parse(junit).getroot().find("testsuite")
    # 6 listed metrics, 2 scenarios, 2 controllers; clearance has no value in `empty`.
    assert suite.attrib["tests"] == "24"
    assert suite.attrib["failures"] == "4"
    assert suite.attrib["skipped"] == "2"
    failed = [case for case in suite if case.find("failure") is not None]
    assert {case.attrib["name"] for case in failed} == {"time_to_goal_s"}
    assert "## Regressions" in markdown.read_text(encoding="utf-8")
    assert (
        "regression: empty, rpp: time_to_goal_s worse: 6 -> 6.6 s (+0.6 in one trial"
        in capsys.readouterr().err
    )


def test_the_command_exits_0_without_one_and_prints_markdown(folders, capsys):
    arguments = [str(folders["slow"]), str(folders["main"]), "--jobs", "1", "--all"]
    assert command.main(arguments) == 0
    assert "## Better" in capsys.readouterr().out


def test_nothing_fails_where_nothing_is_listed(folders, capsys):
    arguments = [str(folders["main"]), str(folders["failing"]), "--jobs", "1"]
    assert command.main([*arguments, "--fail-on", "none"]) == 0


@pytest.mark.parametrize(
    ("listed", "message"),
    [
        ("min_clearence_m", "did you mean 'min_clearance_m'"),
        ("driven_length_m", "cannot get worse; expected one with a good direction"),
    ],
)
def test_wrong_metrics_are_one_line_and_status_2(folders, capsys, listed, message):
    arguments = [str(folders["main"]), str(folders["slow"]), "--fail-on", listed]
    assert command.main(arguments) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert message in error


def test_a_folder_that_is_no_result_is_status_2(folders, tmp_path, capsys):
    assert command.main([str(folders["main"]), str(tmp_path), "--jobs", "1"]) == 2
    assert "not a results folder" in capsys.readouterr().err


def test_a_report_that_cannot_be_written_is_status_2(folders, tmp_path, capsys):
    arguments = [str(folders["main"]), str(folders["main"]), "--jobs", "1"]
    (tmp_path / "no").write_text("a file, in which there can be no other")
    assert command.main([*arguments, "--junit", str(tmp_path / "no" / "x.xml")]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_folders_without_a_common_trial_are_refused(folders, tmp_path):
    other = measured_folder(tmp_path / "other")
    for path in other.glob("trials/*/*/trial_*.parquet"):
        if path.parent.parent.name == "empty":
            path.unlink()
    half = measured_folder(tmp_path / "half")
    for path in half.glob("trials/own_corridor/*/trial_*.parquet"):
        path.unlink()
    with pytest.raises(InputError, match="in common"):
        compared(other, half)


@pytest.fixture(scope="module")
def incomplete(tmp_path_factory):
    """The results of `main` without one controller in one scenario."""
    path = measured_folder(tmp_path_factory.mktemp("incomplete") / "other")
    for log in path.glob("trials/empty/rpp/*.parquet"):
        log.unlink()
    return path


@pytest.mark.parametrize("is_reversed", [False, True])
def test_what_only_one_folder_has_is_told_skipped_and_fails_on_demand(
    folders, incomplete, is_reversed, tmp_path, capsys
):
    pair = [str(folders["main"]), str(incomplete)]
    junit = tmp_path / "junit.xml"
    arguments = [*(reversed(pair) if is_reversed else pair), "--jobs", "1", "--junit", str(junit)]
    assert command.main(arguments) == 0
    told = capsys.readouterr().err
    assert "not compared: empty / rpp: " in told
    suite = ElementTree.parse(junit).getroot().find("testsuite")
    skipped = [case for case in suite if case.find("skipped") is not None]
    assert len(skipped) == int(suite.attrib["skipped"])
    assert len(suite) == int(suite.attrib["tests"])
    assert "trials" in {case.attrib["name"] for case in skipped}
    # A column that is new in a scenario is no gap.
    assert command.main([*arguments, "--require-all"]) == (0 if is_reversed else 1)


def test_scenarios_and_robots_that_differ_are_named(folders, tmp_path, capsys):
    changed = shutil.copytree(folders["main"], tmp_path / "changed")
    for root, goal, mass_kg in ((folders["main"], 2.0, 60.0), (changed, 3.0, 61.0)):
        for kind, text in (
            ("scenarios", f"goal: [{goal}, 0.0, 0.0]"),
            ("robots", f"mass_kg: {mass_kg}\ndescription: {root}\nnavigation: {{a: {goal}}}"),
        ):
            (root / "inputs" / kind).mkdir(parents=True, exist_ok=True)
            (root / "inputs" / kind / "empty.yaml").write_text(text)
    told = compared(folders["main"], changed).changed_inputs
    assert told == (
        f"{changed}: 1 scenario changed: empty; equal seeds there are no equal trials",
        f"{changed}: the robot changed: mass_kg",
    )
    page, markdown = tmp_path / "page.html", tmp_path / "page.md"
    pair = [str(folders["main"]), str(changed), "--jobs", "1"]
    assert command.main([*pair, "--html", str(page), "--markdown", str(markdown)]) == 0
    for text in (page.read_text(), markdown.read_text(), capsys.readouterr().err):
        assert "the robot changed: mass_kg" in text
    (changed / "inputs" / "robots" / "empty.yaml").write_text("mass_kg: [")
    assert command.main(pair) == 2
    assert "empty.yaml: cannot be read: " in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--html", "--markdown", "--junit"])
def test_only_an_earlier_output_of_the_option_is_replaced(folders, tmp_path, capsys, option):
    pair = [str(folders["main"]), str(folders["main"]), "--jobs", "1"]
    manifest, own = tmp_path / "manifest.json", tmp_path / "own"
    manifest.write_text('{"scenarios": []}')
    own.touch()
    assert command.main([*pair, option, str(manifest)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{option} {manifest}: is another file, which does not begin with " in line
    assert manifest.read_text() == '{"scenarios": []}'
    # The empty file is written, then replaced.
    assert [command.main([*pair, option, str(own)]) for _ in range(2)] == [0, 0]
    assert own.stat().st_size > 0


def test_the_path_of_the_page_is_told(folders, tmp_path, capsys):
    page = tmp_path / "page.html"
    pair = [str(folders["main"]), str(folders["main"]), "--jobs", "1"]
    assert command.main([*pair, "--html", str(page)]) == 0
    assert capsys.readouterr().err.splitlines()[0] == f"Open {page}"
    assert page.exists()


def test_a_complete_comparison_satisfies_require_all(folders):
    arguments = [str(folders["main"]), str(folders["main"]), "--jobs", "1", "--require-all"]
    assert command.main(arguments) == 0


def test_in_a_terminal_lines_are_broken_between_words_and_tables_stay():
    row = "| rpp:lookahead_dist=0.4 | 1 |"
    text = f"equal in: rpp:lookahead_dist=0.4 in empty\n{row}\n"
    assert command.wrapped_lines(text, 24) == (
        f"equal in:\nrpp:lookahead_dist=0.4\nin empty\n{row}\n"
    )


def test_a_summary_is_the_last_line_even_where_nothing_changed(folders, capsys):
    assert command.main([str(folders["main"]), str(folders["main"]), "--jobs", "1"]) == 0
    last = capsys.readouterr().err.splitlines()[-1]
    # 2 scenarios and 2 controllers; 6 metrics each, of which clearance has no value in `empty`.
    assert last == (
        "24 comparisons of 6 listed metrics (each controller in each scenario): 0 worse, "
        "0 better, 22 equal in every trial, 2 no value"
    )


def test_all_folders_are_looked_at_before_any_is_analysed(folders, tmp_path, monkeypatch):
    monkeypatch.setattr(compare, "analyse_folder", lambda *_, **__: pytest.fail("began"))
    with pytest.raises(InputError, match="not a results folder"):
        compared(folders["main"], folders["slow"], tmp_path)


def test_worse_tracking_is_a_regression_unless_other_metrics_are_asked_for():
    assert {"cross_track_error_mean_m", "heading_error_mean_deg"} <= set(DEFAULT_LISTED)
