"""Buttons and sliders of a live page: they take time, and change what they say they change."""

from __future__ import annotations

import socket
from io import StringIO

import pandas as pd
import pytest
from rich.console import Console

from drake_navbench.analysis.scenario_analysis import read_trials
from drake_navbench.campaign import live, live_controls
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.live_controls import PACE, PAUSE, RESET, RESTART
from drake_navbench.campaign.live_parameters import sliders_of, with_values
from drake_navbench.commands.main import main
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.trial.trial import simulate

LABEL = "max_linear_vel [m/s]"
UNTOUCHED = live.LiveOptions(rate=0.0, wait_s=None)


class Panel:
    """Meshcat's controls without a browser; clicks and slider values are set by a test."""

    def __init__(self):
        self.clicks, self.values, self.connections = {}, {}, 1

    def AddButton(self, name):
        self.clicks[name] = 0

    def DeleteButton(self, name):
        del self.clicks[name]

    def AddSlider(self, name, low, high, step, value):
        return self.SetSliderValue(name, low + step * round((value - low) / step))

    def DeleteSlider(self, name):
        del self.values[name]

    def SetSliderValue(self, name, value):
        self.values[name] = value
        return value

    def GetSliderValue(self, name):
        return self.values[name]

    def GetButtonClicks(self, name):
        return self.clicks[name]

    def GetNumActiveConnections(self):
        return self.connections


class Scene:
    """A scene that draws nothing; `act` is called with every moment."""

    page = ""

    def __init__(self, act):
        self.show = act


class Page(live.LivePage):
    """A live page whose controls are a Panel; acts: one function for each drive."""

    def __init__(self, *acts):
        self.panel, self.acts, self.told = Panel(), list(acts), StringIO()
        super().__init__(self.panel, Server(), Console(file=self.told, width=200))

    def _scene(self, spec, *, has_controls):
        return Scene(self.acts.pop(0))


class Server:
    address = "http://localhost:1/"


def nothing(moment):
    """Looks on."""


@pytest.fixture(scope="module")
def spec():
    scenario = load_scenario("empty").model_copy(update={"timeout_s": 2.0})
    return plan_campaign([scenario], ["rpp"], trials=1).specs[0]


@pytest.fixture(scope="module")
def unwatched(spec):
    return simulate(spec)


def driven(spec, *acts, options=UNTOUCHED):
    page = Page(*acts)
    log = page.drive_with_controls(spec, options)
    assert not page.panel.values
    assert not page.panel.clicks
    return log


def at(page, time_s, act):
    """An act of the first moment from a time on, once."""
    done = []

    def when(moment):
        if moment.time_s >= time_s and not done:
            done.append(act(page.panel))

    return when


def test_watching_changes_no_byte_of_the_log(spec, unwatched, tmp_path):
    log = driven(spec, nothing)
    same = {name: unwatched.samples[name] for name in UNREPEATABLE_COLUMNS}
    TrialLog(log.samples.assign(**same), *(getattr(log, n) for n in PARTS)).write(tmp_path / "a")
    unwatched.write(tmp_path / "b")
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


PARTS = ("plans", "info", "scans", "diagnostics", "events", "costmaps", "people")


def test_a_moved_slider_acts_from_the_next_cycle_and_is_told(spec, unwatched):
    page = Page()
    page.acts = [at(page, 1.0, lambda panel: panel.SetSliderValue(LABEL, 0.2))]
    log = page.drive_with_controls(spec, UNTOUCHED)
    # Cycles begin at 0.02 s, every 0.05 s: the first one after 1.0 s is at 1.02 s.
    (change,) = log.info["live_changes"]
    assert change == {"time_s": pytest.approx(1.02), "name": "max_linear_vel", "value": 0.2}
    assert live.change_lines(log) == ["max_linear_vel = 0.2 from 1.02 s on"]
    assert log.info["identity"] != unwatched.info["identity"]
    before = unwatched.samples["time_s"] <= 1.02
    columns = [name for name in unwatched.samples if name not in UNREPEATABLE_COLUMNS]
    pd.testing.assert_frame_equal(
        log.samples[before][columns], unwatched.samples[before][columns], check_exact=True
    )
    # RPP drives at its cruise speed on a straight plan.
    assert log.samples["command_v_mps"].iloc[-1] == 0.2
    assert unwatched.samples["command_v_mps"].iloc[-1] == 0.5


def test_the_parameters_of_the_file_come_back_by_a_button(spec):
    page = Page()

    def act(moment):
        if moment.time_s == pytest.approx(0.5):
            page.panel.SetSliderValue(LABEL, 0.2)
        if moment.time_s == pytest.approx(1.0):
            page.panel.clicks[RESET] += 1

    page.acts = [act]
    log = page.drive_with_controls(spec, UNTOUCHED)
    assert [entry["value"] for entry in log.info["live_changes"]] == [0.2, 0.5]
    assert log.samples["command_v_mps"].iloc[-1] == 0.5


def test_a_restart_drives_from_the_beginning(spec, unwatched):
    page = Page()
    page.acts = [at(page, 0.5, lambda panel: panel.clicks.update({RESTART: 1})), nothing]
    log = page.drive_with_controls(spec, UNTOUCHED)
    assert page.acts == []
    assert log.info["identity"] == unwatched.info["identity"]
    assert "live_changes" not in log.info
    assert len(log.samples) == len(unwatched.samples)


def test_a_restart_keeps_the_sliders_as_they_stand(spec):
    page = Page()

    def act(panel):
        panel.SetSliderValue(LABEL, 0.2)
        panel.clicks[RESTART] += 1

    page.acts = [at(page, 0.5, act), nothing]
    log = page.drive_with_controls(spec, UNTOUCHED)
    assert [entry["time_s"] for entry in log.info["live_changes"]] == [pytest.approx(0.02)]


def test_a_pause_ends_with_the_second_click(spec, unwatched, monkeypatch):
    page, slept = Page(), []

    def sleep(seconds):
        slept.append(seconds)
        if len(slept) == 5:
            page.panel.clicks[PAUSE] += 1

    monkeypatch.setattr(live_controls.time, "sleep", sleep)
    page.acts = [at(page, 0.5, lambda panel: panel.clicks.update({PAUSE: 1}))]
    log = page.drive_with_controls(spec, UNTOUCHED)
    assert len(slept) == 5
    assert len(log.samples) == len(unwatched.samples)


def test_a_pace_is_kept(spec, monkeypatch):
    """Without time for computing, 2 s at twice real time are waited for in 1 s."""
    now = [0.0]
    monkeypatch.setattr(live_controls.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(live_controls.time, "sleep", lambda s: now.__setitem__(0, now[0] + s))
    page = Page(nothing)
    page.drive_with_controls(spec, live.LiveOptions(rate=2.0, wait_s=None))
    assert now[0] == pytest.approx(1.0, abs=0.02)
    assert PACE not in page.panel.values


def test_a_value_that_does_not_fit_is_told_and_put_back(spec, unwatched, monkeypatch):
    def refuse(preset, values):
        raise InputError("rpp: max_linear_vel: too slow")

    monkeypatch.setattr(live_controls, "with_values", refuse)
    page = Page()
    page.acts = [at(page, 0.5, lambda panel: panel.SetSliderValue(LABEL, 0.2))]
    log = page.drive_with_controls(spec, UNTOUCHED)
    assert page.told.getvalue() == "rpp: max_linear_vel: too slow\n"
    assert "live_changes" not in log.info
    assert len(log.samples) == len(unwatched.samples)


def test_a_closed_browser_is_one_line(spec):
    page = Page()
    page.acts = [at(page, 0.5, lambda panel: setattr(panel, "connections", 0))]
    with pytest.raises(InputError, match=r"closed at 0\.5 s of the trial and did not come back"):
        page.drive_with_controls(spec, live.LiveOptions(0.0, wait_s=0.1))


def test_no_browser_at_all_is_one_line(capsys, tmp_path):
    what = ["run", "empty", "--controllers", "rpp", "--trials", "1", "--out", str(tmp_path / "out")]
    assert main([*what, "--live", "--live-wait", "0.1"]) == 2
    (fault,) = capsys.readouterr().err.splitlines()
    assert fault.startswith("--live: no browser opened http://localhost:")
    assert fault.endswith("within 0.1 s")


def test_a_port_that_is_taken_is_one_line(capsys):
    with socket.create_server(("localhost", 0)) as taken:
        port = str(taken.getsockname()[1])
        what = ["run", "empty", "--controllers", "rpp", "--trials", "1"]
        assert main([*what, "--live", "--live-port", port]) == 2
    (fault,) = capsys.readouterr().err.splitlines()
    assert fault == f"--live-port {port}: cannot be listened at: Address already in use"


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        (["--live-port", "8000"], "--live-port: expected --live as well"),
        (["--live-wait", "3"], "--live-wait: expected --live as well"),
        (["--live", "--live-port", "70000"], "expected a port of at most 65535"),
        (["--live", "--live-wait", "0"], "expected seconds above 0"),
    ],
)
def test_wrong_options_are_one_line(options, fault, capsys):
    try:
        status = main(["run", "empty", "--controllers", "rpp", *options])
    except SystemExit as ended:
        status = ended.code
    assert status == 2
    assert fault in capsys.readouterr().err


def test_logs_with_moved_sliders_are_no_results(spec, unwatched, tmp_path):
    folder = ResultsFolder(tmp_path)
    page = Page()
    page.acts = [at(page, 1.0, lambda panel: panel.SetSliderValue(LABEL, 0.2))]
    changed = page.drive_with_controls(spec, UNTOUCHED)
    assert live.keep(unwatched, folder) == tmp_path / "trials/empty/rpp/trial_000.parquet"
    path = live.keep(changed, folder)
    assert path == tmp_path / "changed_live/empty/rpp/trial_000.parquet"
    assert TrialLog.read(path).info["live_changes"] == changed.info["live_changes"]


def test_a_report_leaves_them_out_wherever_they_lie(spec, tmp_path):
    page = Page()
    page.acts = [at(page, 1.0, lambda panel: panel.SetSliderValue(LABEL, 0.2))]
    page.drive_with_controls(spec, UNTOUCHED).write(tmp_path / "log.parquet")
    logs, _, left_out = read_trials([tmp_path / "log.parquet"], tmp_path, {})
    assert logs == []
    assert "sliders changed max_linear_vel: no result" in str(left_out[0])


def test_every_slider_is_of_a_number_with_its_range_around_the_value():
    for name in ("rpp", "dwb", "mppi_nav2", "teb", "teb_upstream", "graceful", "vector_pursuit"):
        preset = load_preset(name)
        sliders = sliders_of(preset)
        assert len(sliders) >= 5
        for slider in sliders:
            assert slider.low <= slider.value <= slider.high
            end = slider.low if slider.value > slider.low else slider.high
            other = with_values(preset, {slider.name: end})
            assert other.parameters != preset.parameters


def test_critics_that_do_not_judge_have_no_slider():
    names = [slider.name for slider in sliders_of(load_preset("dwb"))]
    assert "ObstacleFootprint.scale" in names
    assert "BaseObstacle.scale" not in names
