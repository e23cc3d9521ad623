"""A disk that fills up in the middle of a campaign costs no trial: room is all it needs."""

from __future__ import annotations

from small_disk import SmallDisk, on_small_disk

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.driving import run_campaign
from drake_navbench.errors import CannotBeWritten
from drake_navbench.logs.results import ResultsFolder


def test_a_full_disk_leaves_whole_logs_and_the_rest_to_be_driven_when_there_is_room(tmp_path):
    scenario = tmp_path / "short.yaml"
    scenario.write_text("description: short\ngoal: [1.0, 0.0, 0.0]\n")

    def drive_twice(disk: SmallDisk) -> None:
        campaign = plan_campaign([str(scenario)], ["rpp"], trials=5)
        folder = ResultsFolder(disk.path / "out")
        folder.write_manifest({"identity": campaign.identity})
        try:
            run_campaign(campaign, folder, jobs=1)
        except CannotBeWritten as error:
            print(error)
        print("whole", len(list(folder.path.rglob("trial_*.parquet"))))
        print("unfinished", len(list(folder.path.rglob(".*"))))
        disk.grow("50m")
        trials, undriven, _ = run_campaign(campaign, folder, jobs=1)
        print("then", len(trials), *set(trials["outcome"]), len(undriven))

    refused, whole, unfinished, then = on_small_disk(tmp_path, "120k", drive_twice).out
    assert refused.startswith(
        str(tmp_path / "disk" / "out" / "trials" / "short" / "rpp" / "trial_00")
    )
    assert ": cannot be written: " in refused
    assert refused.endswith("No space left on device")
    assert 0 < int(whole.split()[1]) < 5
    assert unfinished == "unfinished 0"
    assert then == "then 5 succeeded 0"
