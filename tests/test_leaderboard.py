"""`drake-navbench leaderboard`: from driven folders to a page, and what is refused."""

from __future__ import annotations

import json
import re
import shutil
from html import unescape

import pandas as pd
import pytest
import yaml

from drake_navbench.campaign.benchmark import run_benchmark
from drake_navbench.commands.main import main
from drake_navbench.commands.replay import _built_in_model

SEEDS = (3, 8)
SCENARIO = """\
description: half a metre straight ahead
goal: [0.5, 0.0, 0.0]
"""
# Too slow to make the progress that is asked for.
COLUMNS = ("rpp", "rpp:desired_linear_vel=0.01")
SUITE = {
    "name": "tiny",
    "version": 2,
    "scenarios": ["short"],
    "trials": 2,
    "robot": "wheelchair",
    "seeds": list(SEEDS),
}


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """Two folders, one a seed, entered for the suite beside them."""
    root = tmp_path_factory.mktemp("driven")
    (root / "short.yaml").write_text(SCENARIO)
    (root / "suite.yaml").write_text(yaml.safe_dump(SUITE))
    for seed in SEEDS:
        out = root / f"seed_{seed}"
        run_benchmark([str(root / "short.yaml")], COLUMNS, trials=2, seed=seed, out=out, jobs=1)
        assert main(["leaderboard", "enter", str(out), "--suite", str(root / "suite.yaml")]) == 0
    return root


@pytest.fixture
def root(driven, tmp_path):
    """A copy that a test may change."""
    return shutil.copytree(driven, tmp_path / "driven")


def build(root, *folders, suite="suite.yaml"):
    results = [str(root / name) for name in folders or [f"seed_{seed}" for seed in SEEDS]]
    out = ["--out", str(root / "board")]
    return main(["leaderboard", "build", *results, "--suite", str(root / suite), *out])


def refusal(root, capsys, *folders):
    """Returns the one line that `build` refuses with."""
    assert build(root, *folders) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
    assert not (root / "board").exists()
    return told.err


def change_json(path, **fields):
    path.write_text(json.dumps(json.loads(path.read_text()) | fields))


def test_two_columns_become_ranks_and_cards_with_replays_of_all_failures(root, capsys):
    assert build(root) == 0
    page = root / "board" / "leaderboard.html"
    assert capsys.readouterr().out == f"{page}\n"
    html = unescape(page.read_text())
    assert html.count('<article class="card"') == 2
    assert "4 failures in 4 trials" in html
    assert "No failure in 4 trials." in html
    assert "Regulated Pure Pursuit with the published settings" in html
    assert "desired_linear_vel" in html
    digest = json.loads((root / "seed_3" / "manifest.json").read_text())["inputs"]
    assert digest["controllers/rpp.yaml"] in html
    links = re.findall(r'href="(replays/[^"]+)"', html)
    watched = re.findall(r'href="(replays/[^"]+)">watch', html)
    assert len(set(watched)) == 4
    assert all((page.parent / link).stat().st_size > 10_000 for link in links)


@pytest.mark.long
def test_folders_of_one_column_each_are_compared_and_keep_their_own_replays(root):
    for number, column in enumerate(COLUMNS):
        for seed in SEEDS:
            path = shutil.copytree(root / f"seed_{seed}", root / f"{number}_{seed}")
            change_json(path / "manifest.json", controllers=[column])
            table = pd.read_parquet(path / "trials.parquet")
            table[table["controller"] == column].to_parquet(path / "trials.parquet")
    assert build(root, *(f"{number}_{seed}" for number in range(2) for seed in SEEDS)) == 0
    replays = sorted((root / "board" / "replays").glob("*/*.html"))
    # One of the controller that never fails, of its first seed; all four of the other.
    assert [path.parent.name for path in replays] == ["entry_1", *2 * ["entry_3"], *2 * ["entry_4"]]


def test_replays_are_drawn_from_the_logs_and_pages_of_an_entry_are_never_read(root):
    own = root / "seed_3"
    for page in (own / "trials/short/rpp/trial_000.html", own / "replays/short.html"):
        page.parent.mkdir(exist_ok=True)
        page.write_text("<script>theirs()</script>")
    assert build(root) == 0
    drawn = list((root / "board").rglob("*.html"))
    assert len(drawn) == 6
    assert not any("theirs()" in page.read_text() for page in drawn)


@pytest.mark.parametrize("step", ["enter", "build"])
@pytest.mark.parametrize(
    "name", ["trials/short/rpp/trial_000.html", "inputs/note.txt", "leaderboard.json", "tables"]
)
def test_an_entry_with_a_link_is_refused(name, step, root, tmp_path, capsys):
    victim = tmp_path / "secret"
    victim.write_text("the organiser's own")
    link = root / "seed_3" / name
    link.unlink(missing_ok=True)
    link.symlink_to(victim)
    enter = ["leaderboard", "enter", str(root / "seed_3"), "--suite", str(root / "suite.yaml")]
    status = build(root) if step == "build" else main(enter)
    assert status == 2
    told = capsys.readouterr().err
    assert told == f"{link}: is a link; an entry has regular files only\n"
    assert not (root / "board").exists()


def test_an_entry_whose_manifest_names_files_elsewhere_is_refused(root, tmp_path, capsys):
    """Otherwise it would tell whether a file of the organiser has a digest."""
    (tmp_path / "secret").write_text("the organiser's own")
    manifest = root / "seed_8" / "manifest.json"
    inputs = json.loads(manifest.read_text())["inputs"]
    for name in ("../../../secret", "/etc/passwd", "controllers/../../manifest.json", ""):
        change_json(manifest, inputs=inputs | {name: "0" * 64})
        assert f"inputs: {name!r}: expected the name of a file in inputs/" in refusal(root, capsys)


def test_a_log_that_names_a_model_elsewhere_has_none(tmp_path):
    (tmp_path / "own.sdf").write_text("<sdf version='1.9'/>")
    assert _built_in_model("wheelchair.sdf") is not None
    for name in (str(tmp_path / "own.sdf"), "../models/wheelchair.sdf", ".", ""):
        assert _built_in_model(name) is None


def test_an_entry_with_another_seed_is_refused(root, capsys):
    (root / "suite.yaml").write_text(yaml.safe_dump(SUITE | {"seeds": [3, 9]}))
    stamp = root / "seed_3" / "leaderboard.json"
    assert "another text of tiny version 2" in refusal(root, capsys)
    enter = ["leaderboard", "enter", str(root / "seed_8"), "--suite", str(root / "suite.yaml")]
    before = stamp.read_text()
    assert main(enter) == 2
    assert "seed: expected the suite's 3 or 9, got 8" in capsys.readouterr().err
    assert stamp.read_text() == before


def test_a_manifest_that_tells_another_seed_than_was_driven_is_found(root, capsys):
    manifest = root / "seed_8" / "manifest.json"
    request = json.loads(manifest.read_text())["request"]
    change_json(manifest, request=request | {"seed": 3})
    assert "seed of short, rpp, trial 0: got " in refusal(root, capsys, "seed_8")


def test_an_unfinished_campaign_is_refused(root, capsys):
    log = root / "seed_8" / "trials" / "short" / "rpp" / "trial_001.parquet"
    log.rename(log.with_suffix(".away"))
    assert "no log of short, rpp, trial 1: not finished" in refusal(root, capsys)
    log.with_suffix(".away").rename(log)
    table = root / "seed_8" / "trials.parquet"
    pd.read_parquet(table).iloc[:-1].to_parquet(table)
    assert "does not have every trial once" in refusal(root, capsys)


def test_a_folder_whose_files_are_broken_is_refused_in_a_line(root, capsys):
    (root / "seed_8" / "trials.parquet").write_bytes(b"no table")
    assert "trials.parquet: cannot be read" in refusal(root, capsys)
    change_json(root / "seed_8" / "manifest.json", controllers=[])
    assert "controllers: missing" in refusal(root, capsys)
    (root / "seed_3" / "leaderboard.json").write_text("{}")
    assert "not what `leaderboard enter` writes" in refusal(root, capsys)


def test_another_version_of_the_suite_is_refused(root, capsys):
    (root / "suite.yaml").write_text(yaml.safe_dump(SUITE | {"version": 3}))
    assert "entered for tiny version 2, expected tiny version 3" in refusal(root, capsys)


def test_what_was_never_entered_is_refused(root, capsys):
    (root / "seed_8" / "leaderboard.json").unlink()
    assert "not entered; expected" in refusal(root, capsys)


def test_every_seed_of_the_suite_is_driven_once(root, capsys):
    assert "lacks the suite's seed 8" in refusal(root, capsys, "seed_3")
    shutil.copytree(root / "seed_3", root / "again")
    assert "rpp with seed 3 is in" in refusal(root, capsys, "seed_3", "again")


def test_a_controller_that_differs_between_its_seeds_is_refused(root, capsys):
    preset = root / "seed_8" / "inputs" / "controllers" / "rpp.yaml"
    preset.write_text(preset.read_text().replace("description: ", "description: other "))
    assert "rpp.yaml: is not what was driven" in refusal(root, capsys)


def test_a_sealed_suite_is_closed_until_its_seeds_are_revealed(root, tmp_path, capsys):
    suite = root / "sealed.yaml"
    suite.write_text(yaml.safe_dump({k: v for k, v in SUITE.items() if k != "seeds"}))
    secret = tmp_path / "secret.yaml"
    given = [str(suite), "--secret", str(secret)]
    assert main(["leaderboard", "seal", *given, "--seeds", "2"]) == 0
    assert build(root, suite="sealed.yaml") == 2
    assert "reveal them first" in capsys.readouterr().err
    kept = secret.read_text()
    secret.write_text(yaml.safe_dump(yaml.safe_load(kept) | {"seeds": list(SEEDS)}))
    assert main(["leaderboard", "reveal", *given]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    secret.write_text(kept)
    assert main(["leaderboard", "reveal", *given]) == 0
    assert "are those that were sealed" in capsys.readouterr().out
    assert build(root, suite="sealed.yaml") == 2
    assert "entered for another text" in capsys.readouterr().err
