"""Results folders that several tests read."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import pytest
from matplotlib.backends.backend_svg import FigureCanvasSVG
from results_folders import write_folder

from drake_navbench.analysis.figures.choice import FigureChoice
from drake_navbench.analysis.report import ReportResult, build_report
from drake_navbench.logs.header import METADATA_KEY, SCHEMA_VERSION
from drake_navbench.logs.results import ResultsFolder


@pytest.fixture
def blank_svgs(monkeypatch) -> None:
    """A figure that is written is empty, also in workers forked from here: nobody looks at it."""
    empty = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"/>'
    monkeypatch.setattr(
        FigureCanvasSVG,
        "print_svg",
        lambda canvas, file, **options: Path(file).write_text(empty, encoding="utf-8"),
    )


@pytest.fixture(scope="session")
def usual(tmp_path_factory) -> Path:
    """A folder with the report that is made unless something else is asked for."""
    path = write_folder(tmp_path_factory.mktemp("usual") / "results", failing=("rpp:v=0.4",))
    build_report(path, jobs=1)
    return path


@pytest.fixture(scope="session")
def reported(tmp_path_factory) -> ReportResult:
    """A folder with one log cut short, one of another schema version and one that is no log."""
    path = write_folder(tmp_path_factory.mktemp("results") / "campaign", failing=("rpp:v=0.4",))
    folder = ResultsFolder(path)
    replay = folder.replay_path("own_corridor")
    replay.parent.mkdir()
    replay.write_text("<!DOCTYPE html><title>replay</title>", encoding="utf-8")
    whole = folder.log_path("empty", "rpp", 0)
    whole.with_name("trial_007.parquet").write_bytes(whole.read_bytes()[:2000])
    table = pq.read_table(whole)
    header = table.schema.metadata[METADATA_KEY].replace(
        f'"schema_version": {SCHEMA_VERSION}'.encode(), b'"schema_version": 99'
    )
    other = table.replace_schema_metadata({METADATA_KEY: header})
    pq.write_table(other, whole.with_name("trial_008.parquet"))
    pq.write_table(table.replace_schema_metadata({}), whole.with_name("trial_009.parquet"))
    return build_report(path, figures=FigureChoice.ALL, jobs=1)
