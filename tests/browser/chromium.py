"""A browser without a window, driven over a pipe in its own protocol: no driver, no port, nothing to install."""

import base64
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
EXECUTABLE = next((found for found in map(shutil.which, NAMES) if found), None)


# the browser reads from descriptor 3 and writes to 4
_START = """import fcntl, os, sys
pair = [fcntl.fcntl(int(number), fcntl.F_DUPFD, 10) for number in sys.argv[1:3]]
os.dup2(pair[0], 3), os.dup2(pair[1], 4)
os.execv(sys.argv[3], sys.argv[3:])"""


class Connection:
    """The two pipes to the browser, which all of its tabs share."""

    def __init__(self, send: int, receive: int) -> None:
        self._send, self._receive, self._unread = send, receive, b""
        self._count = 0
        self.tabs: dict[str, Tab] = {}

    def call(self, session: str, method: str, parameters: dict[str, Any]) -> Any:
        """Ask the browser for something and wait for its answer; events that come before it go to their tabs."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        os.write(self._send, json.dumps(message).encode() + b"\0")
        while (answer := self.read()).get("id") != self._count:
            pass
        assert "error" not in answer, answer
        return answer["result"]

    def read(self) -> Any:
        """The next message; an event is noted by its tab."""
        while b"\0" not in self._unread:
            piece = os.read(self._receive, 1 << 20)
            assert piece, "the browser went away"
            self._unread += piece
        text, _, self._unread = self._unread.partition(b"\0")
        message = json.loads(text)
        tab = self.tabs.get(message.get("sessionId", ""))
        if tab is not None and "id" not in message:
            tab.note(message)
        return message


class Tab:
    """One page of the browser; what it did wrong is collected as it happens."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._session = connection, ""
        self.errors: list[str] = []
        self.requests: list[str] = []
        self._loaded = False
        self._target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=self._target, flatten=True)["sessionId"]
        connection.tabs[self._session] = self
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> Any:
        """Ask the browser for something and wait for its answer."""
        return self._connection.call(self._session, method, parameters)

    def another(self) -> "Tab":
        """A second tab of the same browser."""
        return Tab(self._connection)

    def keep_downloads(self, folder: Path) -> None:
        """Let the browser store what is downloaded, without asking."""
        self._connection.call("", "Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(folder)})

    def close(self) -> None:
        """Close the tab, as its cross does."""
        del self._connection.tabs[self._session]
        self._session = ""
        self.call("Target.closeTarget", targetId=self._target)

    def open(self, page: Path | str, width: int, height: int = 900) -> None:
        """Show a page, by its path or its address, as wide as a screen of `width`; forget what earlier ones did."""
        self.errors, self.requests, self._loaded = [], [], False
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.call("Page.navigate", url=page if isinstance(page, str) else page.as_uri())
        while not self._loaded:
            self._connection.read()

    def holds(self, script: str) -> bool:
        """Whether an expression is true, or something that is there; not while the tab goes to another page."""
        try:
            return bool(self.run(f"Boolean({script})"))
        except AssertionError as gone:
            if "navigated" not in str(gone):
                raise
            return False

    def wait_for(self, script: str, seconds: float = 300.0) -> None:
        """Wait until an expression is true, or something that is there; long, for other work may hold the machine."""
        end = time.monotonic() + seconds
        while not self.holds(script):
            assert time.monotonic() < end, f"waited {seconds:g} s for {script}; {self.run('document.body.innerText')}"
            time.sleep(0.1)

    def drop(self, files: Sequence[Path], selector: str) -> None:
        """Drag files from the machine onto the middle of an element and let them go."""
        box = self.run(f"(r => [r.x + r.width / 2, r.y + r.height / 2])({_found(selector)}.getBoundingClientRect())")
        data = {"items": [], "files": [str(file) for file in files], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            self.call("Input.dispatchDragEvent", type=kind, x=box[0], y=box[1], data=data)

    def click(self, text: str) -> None:
        """Press the button or follow the link that says `text`, once it is there."""
        found = f"[...document.querySelectorAll('button, a')].find(e => e.innerText.trim() == {json.dumps(text)})"
        self.wait_for(found)
        self.run(f"{found}.click()")

    def run(self, script: str) -> Any:
        """The value of an expression in the page, once its promise is kept."""
        found = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def press(self, key: str, code: int, text: str = "") -> None:
        """Press a key and let it go."""
        shared = {"key": key, "code": key, "windowsVirtualKeyCode": code}
        self.call("Input.dispatchKeyEvent", type="keyDown", text=text, **shared)
        self.call("Input.dispatchKeyEvent", type="keyUp", **shared)

    def screenshot(self, target: Path) -> None:
        """A picture of the whole page."""
        content = self.call("Page.getLayoutMetrics")["cssContentSize"]
        clip = {"x": 0, "y": 0, "width": content["width"], "height": content["height"], "scale": 1}
        shot = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=True, clip=clip)
        target.write_bytes(base64.b64decode(shot["data"]))

    def note(self, event: Any) -> None:
        """Keep what an event says of the page."""
        method, params = event.get("method"), event.get("params", {})
        if method == "Page.loadEventFired":
            self._loaded = True
        elif method == "Runtime.exceptionThrown":
            self.errors.append(str(params["exceptionDetails"].get("exception", params)))
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.errors.append(str(params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.errors.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent" and not params["request"]["url"].startswith("data:"):
            self.requests.append(params["request"]["url"])
        elif method == "Network.webSocketCreated":
            self.requests.append(params["url"])


def _found(selector: str) -> str:
    return f"document.querySelector({json.dumps(selector)})"


@contextmanager
def tab(profile: Path) -> Iterator[Tab]:
    """A running browser with one tab."""
    assert EXECUTABLE is not None
    (their_read, send), (receive, their_write) = os.pipe(), os.pipe()
    options = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run")
    command = [EXECUTABLE, *options, f"--user-data-dir={profile}", "--remote-debugging-pipe"]
    start = [sys.executable, "-c", _START, str(their_read), str(their_write), *command]
    browser = subprocess.Popen(start, pass_fds=(their_read, their_write), stderr=subprocess.DEVNULL)
    os.close(their_read)
    os.close(their_write)
    try:
        yield Tab(Connection(send, receive))
    finally:
        os.close(send)
        os.close(receive)
        browser.terminate()
        browser.wait(30)
