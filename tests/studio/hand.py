"""A hand on the mouse in a page of a studio, in a real browser."""

from __future__ import annotations

import time

from browser import Browser

WHERE = """(() => {{
  const view = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name({name!r}));
  view.el.scrollIntoView({{block: "center"}});
  const box = view.el.getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
}})()"""
# A place of the picture's floor on the screen.
ON_FLOOR = """(() => {{
  const view = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name("floor"));
  const box = view.el.getBoundingClientRect(), canvas = view.canvas_view.el.getBoundingClientRect();
  return [canvas.x + view.frame.x_scale.compute({x}), canvas.y + view.frame.y_scale.compute({y})];
}})()"""


class Hand:
    """A browser with a studio's page, and a hand on the mouse."""

    def __init__(self, browser: Browser, studio) -> None:
        self.browser, self._studio = browser, studio

    def open(self, page: str) -> None:
        self.browser.open(self._studio.page(page))
        self.browser.wait_for("Bokeh.documents.length && Bokeh.documents[0].is_idle")

    def open_scenario(self, choice: str, name: str) -> None:
        """Opens a scenario, also where an earlier test has left steps that are not saved.

        choice: as the page lists it, such as 'file:a.yaml', or 'new'. name: the file's name then.
        """
        self.open("scenario")
        of = "Bokeh.documents[0].get_model_by_name({!r}).{}"
        is_refused = f"{of.format('line', 'text')}.includes('choose once more')"
        is_open = f"{of.format('save as', 'value')} === {name!r}"
        self.set("file", "value", repr(choice))
        self.browser.wait_for(f"{is_refused} || {is_open}")
        if self.browser.evaluate(is_refused):
            self.set("file", "value", repr(choice))
        self.browser.wait_for(is_open)

    def click(self, name: str) -> None:
        x, y = self.browser.evaluate(WHERE.format(name=name))
        self.browser.drag((x, y), (x, y))

    def take(self, tool: str) -> None:
        self.set("tool", "active", f"m.labels.indexOf({tool!r})")

    def set(self, name: str, field: str, value: str) -> None:
        self.browser.evaluate(
            f"(() => {{ const m = Bokeh.documents[0].get_model_by_name({name!r});"
            f" m.{field} = {value}; }})()"
        )

    def drag(self, begin: tuple[float, float], end: tuple[float, float]) -> None:
        places = [self.browser.evaluate(ON_FLOOR.format(x=x, y=y)) for x, y in (begin, end)]
        self.browser.drag(tuple(places[0]), tuple(places[1]))

    def tap(self, place: tuple[float, float]) -> None:
        x, y = self.browser.evaluate(ON_FLOOR.format(x=place[0], y=place[1]))
        self.browser.drag((x, y), (x, y))

    def hold(self, place: tuple[float, float], seconds: float) -> None:
        """Clicks with a button that stays down."""
        x, y = self.browser.evaluate(ON_FLOOR.format(x=place[0], y=place[1]))
        self.browser.move(x, y, is_down=False)
        self.browser.press(x, y)
        time.sleep(seconds)
        self.browser.release(x, y)

    def wait_text(self, name: str, text: str) -> None:
        self.browser.wait_for(
            f"Bokeh.documents[0].get_model_by_name({name!r}).text.includes({text!r})"
        )

    def wait_gone(self, name: str, text: str) -> None:
        self.browser.wait_for(
            f"!Bokeh.documents[0].get_model_by_name({name!r}).text.includes({text!r})"
        )
