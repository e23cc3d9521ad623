"""Many worlds are driven as a suite: totals in the terminal, in the report and as a table."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd

from drake_navbench.commands.run import EXIT_DONE, main


def write_barn_worlds(folder, numbers):
    """Writes worlds with two cylinders beside the way, and a straight reference path."""
    (folder / "path_files").mkdir(parents=True)
    for number in numbers:
        models = "".join(
            f"<model name='unit_cylinder_{k}'><pose>{x} 8 0 0 0 0</pose><cylinder>"
            "<radius>0.075</radius></cylinder></model>"
            for k, x in enumerate((-3.5, -1.0))
        )
        (folder / f"world_{number}.world").write_text(f"<sdf><world>{models}</world></sdf>")
        cells = np.array([[14, column] for column in range(30)])
        np.save(folder / "path_files" / f"path_{number}.npy", cells)


def test_barn_worlds_are_told_by_their_totals(tmp_path, capsys):
    write_barn_worlds(tmp_path / "barn", [0, 80])
    out = tmp_path / "results"
    arguments = ["--barn", str(tmp_path / "barn"), "--controllers", "rpp", "--trials", "1"]
    arguments += ["--robot", "round_robot", "--figures", "none", "--replay", "none"]
    assert main([*arguments, "--jobs", "1", "--out", str(out)]) == EXIT_DONE
    printed = capsys.readouterr().out
    assert re.search(r"rpp +all +2 +100% \(34 to 100\) +0% \(0 to 66\)", printed)
    table = pd.read_csv(out / "totals.csv")
    assert table["density"].tolist() == ["all", "15%", "20%"]
    # 10 m at 0.5 m/s, of which the last one does not count.
    assert table["score"].between(0.26, 0.32).all()
    report = (out / "report.html").read_text()
    assert "Totals over worlds" in report
    trials = pd.read_parquet(out / "trials.parquet")
    assert trials["suite"].tolist() == ["BARN", "BARN"]
