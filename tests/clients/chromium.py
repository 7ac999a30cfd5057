"""Chromium without a window, driven through its debugging pipe: no port, no other package."""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Any

import clients

NAMES = ("chromium", "chromium-browser", "google-chrome")
SECONDS = 60
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-sync",
    "--no-first-run",
    "--hide-scrollbars",
    "--disable-dev-shm-usage",
    "--remote-debugging-pipe",
)
HANDLES = (
    "import os, sys; there, back = (os.dup(int(x)) for x in sys.argv[1:3]);"
    "os.dup2(there, 3); os.dup2(back, 4); os.set_inheritable(3, True);"
    "os.set_inheritable(4, True); os.execv(sys.argv[3], sys.argv[3:])"
)

Facts = dict[str, Any]


def chromium() -> str:
    """The path of the browser."""
    found = next((path for name in NAMES if (path := shutil.which(name))), None)
    return found or clients.missing("chromium")


class Browser:
    """One tab of a fresh browser; what it says and asks for is kept in ``events``."""

    def __init__(self, profile: Path, *flags: str, width: int = 1280, height: int = 900) -> None:
        there, self._write = os.pipe()
        self._read, back = os.pipe()
        words = [*FLAGS, f"--user-data-dir={profile}", f"--window-size={width},{height}", *flags]
        # the browser reads its third handle and writes its fourth; each message ends with a 0
        self._process = subprocess.Popen(
            [sys.executable, "-c", HANDLES, str(there), str(back), chromium(), *words],
            pass_fds=(there, back),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(there)
        os.close(back)
        self._left, self._number, self._session = b"", 0, ""
        self.events: list[Facts] = []

    def __enter__(self) -> Browser:
        try:
            target = self.call("Target.createTarget", url="about:blank")["targetId"]
            attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
            self._session = attached["sessionId"]
            for domain in ("Page", "Runtime", "Network", "Log"):
                self.call(f"{domain}.enable")
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._process.terminate()
        self._process.wait(SECONDS)
        os.close(self._read)
        os.close(self._write)

    def call(self, method: str, **parameters: Any) -> Facts:
        """The answer to a command; events that come meanwhile are kept."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._number:
                assert "error" not in answer, f"{method}: {answer['error']}"
                result: Facts = answer["result"]
                return result
            self.events.append(answer)

    def _next(self) -> Facts:
        """The next message."""
        until = time.monotonic() + SECONDS
        while b"\0" not in self._left:
            ready, _, _ = select.select([self._read], [], [], until - time.monotonic())
            data = os.read(self._read, 1 << 16) if ready else b""
            assert data, "the browser says nothing"
            self._left += data
        message, _, self._left = self._left.partition(b"\0")
        told: Facts = json.loads(message)
        return told

    def open(self, page: Path) -> float:
        """Load a file and wait until its script is ready; how many seconds that took."""
        self.events.clear()
        start = time.monotonic()
        self.call("Page.navigate", url=page.as_uri())
        while not self.run("Boolean(window.devcad && window.devcad.ready)"):
            assert time.monotonic() - start < SECONDS, "the page is never ready"
            time.sleep(0.01)
        return time.monotonic() - start

    def run(self, code: str) -> Any:
        """The value of an expression in the page, after its promise where it is one."""
        answer = self.call(
            "Runtime.evaluate",
            expression=code,
            returnByValue=True,
            awaitPromise=True,
            allowUnsafeEvalBlockedByCSP=False,
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        """One event of the mouse, at a place of the window."""
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def screenshot(self, out: Path) -> None:
        """The page as it looks, as PNG."""
        out.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))

    def requests(self) -> list[str]:
        """The addresses that were asked for since the page was opened."""
        return [
            event["params"]["request"]["url"]
            for event in self.events
            if event.get("method") == "Network.requestWillBeSent"
        ]

    def complaints(self) -> list[Facts]:
        """What the console and the log say at the levels of warnings and errors, but for what a
        browser without a graphics card says of its own reading back."""
        return [
            event
            for event in self.events
            if event.get("method") == "Runtime.exceptionThrown"
            or (
                event.get("method") == "Runtime.consoleAPICalled"
                and event["params"]["type"] in ("error", "warning", "assert")
            )
            or (
                event.get("method") == "Log.entryAdded"
                and event["params"]["entry"]["level"] in ("error", "warning")
                and "GPU stall due to ReadPixels" not in event["params"]["entry"]["text"]
            )
        ]
