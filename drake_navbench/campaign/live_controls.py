"""The controls of a live page: pause, restart, pace, and sliders of the controller's parameters.

They are Meshcat's own buttons and sliders. Without a moved slider nothing of the trial depends on
them: they only take time.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import NamedTuple

from pydrake.geometry import Meshcat

from drake_navbench.campaign.live_parameters import Change, Slider, sliders_of, with_values
from drake_navbench.controller import Controller, ControllerError
from drake_navbench.errors import InputError
from drake_navbench.explanation import ControlCycle
from drake_navbench.logs.moment import Moment
from drake_navbench.trial.column_controller import built_controller
from drake_navbench.trial.diagram import Observers
from drake_navbench.trial.spec import TrialSpec

PAUSE, RESTART, RESET = "pause / go on", "restart", "parameters as in the file"
PACE = "speed [times real time]"
SLOWEST, FASTEST = 0.1, 5.0
POLL_S = 0.05
# A slider's steps are powers of ten; values are rounded to so many decimals.
DECIMALS = 9
# The period in which predictions are computed for the page, s of the trial.
DRAWN_PERIOD_S = 0.25


class Restart(Exception):
    """A click on restart: the trial begins again."""


class Patience(NamedTuple):
    """The wait for a browser: at most limit_s, s. address: the page's, for the message."""

    limit_s: float
    address: str


class LiveControls:
    """The controls while one trial drives; for a `with` statement, which takes them away again.

    rate: the pace at the beginning, times real time; 0 as fast as possible, without a slider.
    patience: None drives without a browser. changes: the moved sliders so far.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        spec: TrialSpec,
        *,
        rate: float,
        patience: Patience | None,
        tell: Callable[[str], None],
    ) -> None:
        self._meshcat, self._spec, self._rate = meshcat, spec, rate
        self._patience, self._tell = patience, tell
        self._sliders = sliders_of(spec.preset)
        self._first: dict[str, float] = {}
        self._readings: dict[str, float] = {}
        self._values: dict[str, float] = {}
        self._clicks: dict[str, int] = {}
        self._controllers = ExitStack()
        self._drawing: Controller | None = None
        self._cycle: ControlCycle | None = None
        self.changes: list[Change] = []

    def __enter__(self) -> LiveControls:
        self._clicks = {name: 0 for name in (PAUSE, RESTART)}
        if self._sliders:
            self._clicks[RESET] = 0
        for name in self._clicks:
            self._meshcat.AddButton(name)
        if self._rate > 0.0:
            self._meshcat.AddSlider(PACE, SLOWEST, FASTEST, SLOWEST, self._rate)
        for slider in self._sliders:
            # The slider shows a rounded value; the parameter keeps its own until the slider is
            # moved.
            self._first[slider.name] = self._meshcat.AddSlider(
                slider.label, slider.low, slider.high, slider.step, slider.value
            )
        return self

    def __exit__(self, *error: object) -> None:
        self._controllers.close()
        for name in self._clicks:
            self._meshcat.DeleteButton(name)
        if self._rate > 0.0:
            self._meshcat.DeleteSlider(PACE)
        for slider in self._sliders:
            self._meshcat.DeleteSlider(slider.label)

    def begin(self) -> None:
        """Begins a drive with the present positions of the sliders."""
        self._controllers.close()
        self._values, self.changes, self._cycle = {}, [], None
        self._readings = dict(self._first)
        self._drawing = self._built(self._values, draws=True)
        self._clock_s: tuple[float, float] | None = None
        self._drawn_s = -DRAWN_PERIOD_S
        self._diagnostics: dict[str, object] = {}
        self.wait_for_browser("")

    def observers(self, show: Callable[[Moment], None]) -> Observers:
        """Returns the observers of a drive; show: function that draws a moment."""

        def watch(moment: Moment) -> None:
            show(moment._replace(diagnostics=self._for_drawing(moment.time_s)))
            self._pace(moment.time_s)

        return Observers(watch, on_cycle=self._on_cycle, takes_over=self._takes_over)

    def _on_cycle(self, cycle: ControlCycle) -> None:
        self._cycle = cycle

    def _for_drawing(self, time_s: float) -> dict[str, object]:
        """Returns the last cycle's diagnostics with arrays, for the page.

        A second controller computes them: the log equals that of a trial without a page.
        """
        if self._cycle is None or time_s - self._drawn_s < DRAWN_PERIOD_S:
            return self._diagnostics
        self._drawn_s = time_s
        assert self._drawing is not None
        try:
            decision = self._drawing.step(self._cycle.observation, self._cycle.memory)
        except ControllerError:
            self._diagnostics = {}
        else:
            self._diagnostics = dict(decision.diagnostics)
        return self._diagnostics

    def _takes_over(self, time_s: float) -> Controller | None:
        """Returns a controller with the sliders' values where one was moved, else None."""
        moved = [slider for slider in self._sliders if self._is_moved(slider)]
        if not moved:
            return None
        values = dict(self._values)
        for slider in moved:
            reading = self._meshcat.GetSliderValue(slider.label)
            self._readings[slider.name] = reading
            is_back = reading == self._first[slider.name]
            values[slider.name] = slider.value if is_back else round(reading, DECIMALS)
        try:
            driving, drawing = self._built(values), self._built(values, draws=True)
        except InputError as error:
            self._tell(str(error))
            for slider in moved:
                self._put_back(slider)
            return None
        self._drawing, self._values = drawing, values
        self.changes += [Change(time_s, s.name, values[s.name]) for s in moved]
        return driving

    def _is_moved(self, slider: Slider) -> bool:
        return self._meshcat.GetSliderValue(slider.label) != self._readings[slider.name]

    def _put_back(self, slider: Slider) -> None:
        value = self._values.get(slider.name, slider.value)
        self._readings[slider.name] = self._meshcat.SetSliderValue(slider.label, value)

    def _built(self, values: dict[str, float], *, draws: bool = False) -> Controller:
        spec = self._spec
        preset = with_values(spec.preset, values) if values else spec.preset
        robot = spec.preset.robot(spec.robot)
        return self._controllers.enter_context(
            built_controller(preset, robot, wants_diagnostics=draws)
        )

    def _pace(self, time_s: float) -> None:
        """Waits until the page may see the next moment; raises Restart and InputError."""
        self._follow_buttons(time_s)
        if self._patience is not None and self._meshcat.GetNumActiveConnections() == 0:
            self.wait_for_browser(f" at {time_s:.1f} s of the trial")
            self._clock_s = None
        if self._rate == 0.0:
            return
        rate = self._meshcat.GetSliderValue(PACE)
        now_s = time.monotonic()
        if self._clock_s is None or rate != self._rate:
            self._rate, self._clock_s = rate, (now_s, time_s)
        began_s, from_s = self._clock_s
        time.sleep(max(0.0, began_s + (time_s - from_s) / rate - now_s))

    def _follow_buttons(self, time_s: float) -> None:
        """Waits while paused, and notices a restart."""
        paused = self._is_clicked(PAUSE)
        while True:
            if RESET in self._clicks and self._is_clicked(RESET):
                for slider in self._sliders:
                    self._meshcat.SetSliderValue(slider.label, self._first[slider.name])
            if self._is_clicked(RESTART):
                raise Restart
            if not paused or self._is_clicked(PAUSE):
                break
            self._clock_s = None
            if self._patience is not None and self._meshcat.GetNumActiveConnections() == 0:
                self.wait_for_browser(f" at {time_s:.1f} s of the trial")
            time.sleep(POLL_S)

    def _is_clicked(self, name: str) -> bool:
        """Whether a button was clicked an odd number of times since it was last asked for."""
        clicks = self._meshcat.GetButtonClicks(name)
        is_odd = (clicks - self._clicks[name]) % 2 == 1
        is_clicked = is_odd if name == PAUSE else clicks > self._clicks[name]
        self._clicks[name] = clicks
        return is_clicked

    def wait_for_browser(self, when: str) -> None:
        """Waits until a browser shows the page; raises InputError where none does in time."""
        if self._patience is None:
            return
        ends_s = time.monotonic() + self._patience.limit_s
        while self._meshcat.GetNumActiveConnections() == 0:
            if time.monotonic() >= ends_s:
                limit = f"{self._patience.limit_s:g} s"
                if when:
                    raise InputError(
                        f"--live: the browser was closed{when} and did not come back within {limit}"
                    )
                raise InputError(
                    f"--live: no browser opened {self._patience.address} within {limit}"
                )
            time.sleep(POLL_S)
