"""A headless Chromium, driven by chromedriver through the WebDriver protocol (W3C) with nothing but the standard library."""
from __future__ import annotations

import base64
import json
import re
import subprocess
import urllib.error
import urllib.request
from pathlib import Path
from types import TracebackType
from typing import Any


class Browser:
    """One window. Use it in a `with` statement: it ends the browser and its driver."""

    def __init__(self, *arguments: str) -> None:
        """`arguments`: more of them for Chromium. It uses no GPU, unless they name one for Vulkan."""
        # Port 0: the driver takes a free one and says which.
        self._driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        assert self._driver.stdout
        port = None
        for line in self._driver.stdout:
            if found := re.search(r"started successfully on port (\d+)", line):
                port = found.group(1)
                break
        if port is None:
            raise RuntimeError("chromedriver does not start")
        self._address = f"http://127.0.0.1:{port}/session"
        # --no-sandbox: Chromium refuses to run as root with it.
        gpu = [] if any(argument.startswith("--use-vulkan") for argument in arguments) else ["--disable-gpu"]
        options = {"args": ["--headless=new", "--no-sandbox", *gpu, "--hide-scrollbars", "--disable-dev-shm-usage", *arguments]}
        started = self._ask("POST", "", {"capabilities": {"alwaysMatch": {
            "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}}})
        self._address += "/" + started["sessionId"]

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            self._ask("DELETE", "")
        finally:
            self._driver.terminate()
            self._driver.wait()

    def _ask(self, method: str, path: str, body: dict[str, Any] | None = None) -> Any:
        data = None if method != "POST" else json.dumps(body or {}).encode()
        request = urllib.request.Request(self._address + path, data=data, method=method)
        try:
            with urllib.request.urlopen(request, timeout=120) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(json.load(error)["value"]["message"]) from None

    def devtools(self, command: str, **parameters: Any) -> Any:
        """A command of the DevTools protocol."""
        return self._ask("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def show(self, page: Path | str, width: int, dark: bool, height: int = 900) -> None:
        """Opens a file or an address in a window of this size, with the system's colours light or dark."""
        self.devtools("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600)
        self.devtools("Emulation.setEmulatedMedia",
                      features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
        self._ask("POST", "/url", {"url": page if isinstance(page, str) else page.resolve().as_uri()})

    def run(self, script: str) -> Any:
        """What a script returns, as JSON has it."""
        return self._ask("POST", "/execute/sync", {"script": script, "args": []})

    def messages(self) -> list[str]:
        """What the console has got since the last call."""
        return [entry["message"] for entry in self._ask("POST", "/se/log", {"type": "browser"})]

    def picture(self, file: Path) -> None:
        """The whole page, as a PNG."""
        size = self.run("return [document.documentElement.clientWidth, document.documentElement.scrollHeight]")
        shot = self.devtools("Page.captureScreenshot", captureBeyondViewport=True,
                             clip={"x": 0, "y": 0, "width": size[0], "height": min(size[1], 12000), "scale": 1})
        file.write_bytes(base64.b64decode(shot["data"]))
