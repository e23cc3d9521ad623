"""A headless Chromium, driven through its DevTools protocol over a pipe: real clicks and pictures.

Needs the program `chromium` (Debian's package of that name) and nothing else.
"""

from __future__ import annotations

import base64
import fcntl
import json
import os
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
NO_CHROMIUM = "there is no program chromium"
# How often a page is asked for what it does not show yet. A busy computer answers later, not less.
LOOKS = 2400
POLL_S = 0.05
# Where the screenshots go, for people to look at.
ARTIFACTS_VARIABLE = "DRAKE_NAVBENCH_TEST_ARTIFACTS"
DEFAULT_ARTIFACTS = Path(__file__).parents[2] / "test-artifacts"
# The descriptors by which Chromium listens and answers.
LISTENS_AT, ANSWERS_AT, FIRST_FREE = 3, 4, 10
WINDOW = (1280, 900)
# No window, no processor for graphics, no talk with the network.
HEADLESS_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
)
FLAGS = (
    *HEADLESS_FLAGS,
    # What a page might ask of a server elsewhere would fail at once, and be seen.
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE localhost",
    "--remote-debugging-pipe",
    f"--window-size={WINDOW[0]},{WINDOW[1]}",
)


def artifacts_folder() -> Path:
    """Returns the folder of the screenshots, which exists then."""
    folder = Path(os.environ.get(ARTIFACTS_VARIABLE, DEFAULT_ARTIFACTS))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


class Browser:
    """One tab of a Chromium of its own; to be used in a `with` statement.

    requests: every address that the pages asked for, web sockets included. errors: what stood in
    red on the console: exceptions, console.error and what could not be loaded.
    """

    def __init__(self, profile: Path) -> None:
        self.requests: list[str] = []
        self.errors: list[str] = []
        self._count = 0
        self._unread = b""
        self._session: str | None = None
        their_in, self._out = os.pipe()
        self._in, their_out = os.pipe()
        # Out of the way of the descriptors that they are to become.
        spare = [fcntl.fcntl(fd, fcntl.F_DUPFD, FIRST_FREE) for fd in (their_in, their_out)]

        def take_places() -> None:
            os.dup2(spare[0], LISTENS_AT)
            os.dup2(spare[1], ANSWERS_AT)

        self._process = subprocess.Popen(
            [CHROMIUM, *FLAGS, f"--user-data-dir={profile}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            close_fds=False,
            preexec_fn=take_places,
        )
        for descriptor in (their_in, their_out, *spare):
            os.close(descriptor)

    def __enter__(self) -> Browser:
        target = self._ask("Target.createTarget", url="about:blank")["targetId"]
        attached = self._ask("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self._ask(f"{domain}.enable")
        return self

    def __exit__(self, *exception: object) -> None:
        self._process.terminate()
        self._process.wait()
        os.close(self._in)
        os.close(self._out)

    def open(self, address: str) -> None:
        """Opens an address and waits until everything is loaded."""
        failure = self._ask("Page.navigate", url=address).get("errorText")
        if failure:
            raise OSError(f"{address}: {failure}")
        self.wait_for(f"document.readyState === 'complete' && location.href === {address!r}")

    def evaluate(self, expression: str) -> Any:
        """Returns the value of a JavaScript expression, a promise's when it is kept."""
        answer = self._ask(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in answer:
            raise ValueError(f"{expression}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def wait_for(self, expression: str) -> None:
        """Waits until a JavaScript expression is true; one that cannot be evaluated is not yet."""
        for _ in range(LOOKS):
            try:
                if self.evaluate(expression):
                    return
            except ValueError:
                pass
            time.sleep(POLL_S)
        raise TimeoutError(f"not in {LOOKS} looks: {expression}; console: {self.errors}")

    def click(self, selector: str) -> None:
        """Scrolls to an element and clicks in its middle, as a person would."""
        x, y = self.evaluate(
            f"""(() => {{
              const element = document.querySelector({selector!r});
              element.scrollIntoView({{block: "center"}});
              const box = element.getClientRects()[0];
              return [box.x + box.width / 2, box.y + box.height / 2];
            }})()"""
        )
        for kind in ("mousePressed", "mouseReleased"):
            self._ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def drag(self, begin: tuple[float, float], end: tuple[float, float]) -> None:
        """Presses the button at a place of the window, moves the mouse, and releases it."""
        self.move(*begin, is_down=False)
        self.press(*begin)
        self.move(*end)
        self.release(*end)

    def press(self, x: float, y: float) -> None:
        """Presses the mouse's button."""
        self._mouse("mousePressed", x, y, button="left", buttons=1)

    def move(self, x: float, y: float, *, is_down: bool = True) -> None:
        """Moves the mouse, its button pressed or not."""
        button = "left" if is_down else "none"
        self._mouse("mouseMoved", x, y, button=button, buttons=int(is_down))

    def release(self, x: float, y: float) -> None:
        """Releases the mouse's button."""
        self._mouse("mouseReleased", x, y, button="left", buttons=0)

    def _mouse(self, kind: str, x: float, y: float, **how: Any) -> None:
        self._ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, clickCount=1, **how)

    def work_s(self) -> float:
        """Returns the processor time of the page's main thread so far, s."""
        self._ask("Performance.enable", timeDomain="threadTicks")
        found = self._ask("Performance.getMetrics")["metrics"]
        return next(entry["value"] for entry in found if entry["name"] == "TaskDuration")

    def resize(self, width: int, height: int, *, is_dark: bool = False) -> None:
        """Gives the window another size, and the pages the other colours."""
        self._ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if is_dark else "light"}
        self._ask("Emulation.setEmulatedMedia", features=[scheme])

    def restore(self) -> None:
        """Gives the window back its own size, and the pages their own colours."""
        self._ask("Emulation.clearDeviceMetricsOverride")
        self._ask("Emulation.setEmulatedMedia", features=[])

    def printed(self, name: str) -> bytes:
        """Returns the page as it is printed, as PDF, and keeps it as a test artefact."""
        pdf = base64.b64decode(self._ask("Page.printToPDF", preferCSSPageSize=True)["data"])
        (artifacts_folder() / f"{name}.pdf").write_bytes(pdf)
        return pdf

    def screenshot(self, name: str) -> Path:
        """Keeps a picture of the window as a test artefact; returns its path."""
        path = artifacts_folder() / f"{name}.png"
        path.write_bytes(base64.b64decode(self._ask("Page.captureScreenshot")["data"]))
        return path

    def _ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while (answer := self._next_message()).get("id") != self._count:
            self._note(answer)
        if "error" in answer:
            raise ValueError(f"{method}: {answer['error']}")
        return answer["result"]

    def _next_message(self) -> dict[str, Any]:
        while b"\0" not in self._unread:
            chunk = os.read(self._in, 1 << 20)
            if not chunk:
                raise OSError("Chromium does not answer")
            self._unread += chunk
        message, _, self._unread = self._unread.partition(b"\0")
        return json.loads(message)

    def _note(self, event: dict[str, Any]) -> None:
        method, found = event.get("method"), event.get("params", {})
        if method == "Network.requestWillBeSent":
            self.requests.append(found["request"]["url"])
        elif method == "Network.webSocketCreated":
            self.requests.append(found["url"])
        elif method == "Runtime.exceptionThrown":
            self.errors.append(json.dumps(found["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and found["type"] == "error":
            self.errors.append(json.dumps(found["args"]))
        elif method == "Log.entryAdded" and found["entry"]["level"] == "error":
            self.errors.append(found["entry"]["text"])
