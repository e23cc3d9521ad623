"""How much faster two workers drive a campaign than one; on a machine with nothing else to do."""

import time
from itertools import count

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.driving import run_campaign
from drake_navbench.logs.results import ResultsFolder

TRIALS = 96


def test_bench_two_workers(benchmark, tmp_path):
    """`times_one_worker` should be 1.85 at least."""
    campaign = plan_campaign(["empty"], ["rpp"], trials=TRIALS)
    folders = (ResultsFolder(tmp_path / str(number)) for number in count())

    def drive(jobs):
        folder = next(folders)
        folder.write_manifest({"identity": campaign.identity})
        assert len(run_campaign(campaign, folder, jobs=jobs).trials) == TRIALS

    # The server of the workers starts, and the kernels are there.
    drive(2)
    alone_s = []
    for _ in range(2):
        started_s = time.perf_counter()
        drive(1)
        alone_s.append(time.perf_counter() - started_s)
    benchmark.pedantic(drive, args=[2], rounds=2)
    benchmark.extra_info["times_one_worker"] = round(min(alone_s) / benchmark.stats.stats.min, 2)
