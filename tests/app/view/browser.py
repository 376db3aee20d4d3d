# SPDX-License-Identifier: Apache-2.0
"""Chromium without a screen, driven over its DevTools protocol."""

import base64
import json
import re
import shutil
import urllib.request
from pathlib import Path

from bench import PATIENCE_S, Program
from web_socket import WebSocket

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
# It draws WebGL without a graphics card. As root it has no sandbox, and it sees pages of this machine alone.
OPTIONS = ("--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
           "--disable-dev-shm-usage", "--no-first-run", "--disable-extensions", "--disable-sync", "--disable-component-update",
           "--disable-background-networking", "--hide-scrollbars", "--remote-debugging-port=0")


class Browser(Program):
    """One page. What it logs as an error is kept in `complaints`.

    folder: for its profile and log
    """

    def __init__(self, folder, size=(1440, 900), *more):
        folder = Path(folder)
        self.complaints = []
        words = [CHROMIUM, *OPTIONS, f"--user-data-dir={folder}/profile", f"--window-size={size[0]},{size[1]}", *more, "about:blank"]
        super().__init__(words, folder / "chromium.log")
        self.wait_for("DevTools listening on")
        port = int(re.search(r"DevTools listening on ws://127[.]0[.]0[.]1:(\d+)/", self.said())[1])
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list", timeout=PATIENCE_S) as answer:
            target = next(each for each in json.load(answer) if each["type"] == "page")
        self._socket = WebSocket(port, "/" + target["webSocketDebuggerUrl"].split("/", 3)[3], timeout=PATIENCE_S)
        self._last_id = 0
        self.size = size
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def __exit__(self, *_):
        self._socket.close()
        super().__exit__()

    def call(self, method, **parameters):
        number = self._send(method, parameters)
        while (message := self._socket.read()) is None or message.get("id") != number:
            if message is None:
                raise AssertionError(f"Chromium has gone; it said: {self.said()}")
            if "method" in message:
                self._note(message["method"], message["params"])
        if "error" in message:
            raise AssertionError(f"{method}: {message['error']['message']}")
        return message["result"]

    def _send(self, method, parameters):
        self._last_id += 1
        self._socket.send({"id": self._last_id, "method": method, "params": parameters})
        return self._last_id

    def _note(self, event, details):
        if event == "Page.javascriptDialogOpening":  # the answer to every question is yes
            self._send("Page.handleJavaScriptDialog", {"accept": True})
        if event == "Runtime.exceptionThrown":
            self.complaints.append(json.dumps(details["exceptionDetails"]))
        if event == "Log.entryAdded" and details["entry"]["level"] == "error":
            self.complaints.append(details["entry"]["text"])

    def open(self, url):
        self.call("Page.navigate", url=url)

    def ask(self, expression):
        """The value of JavaScript, which may wait; `page` is what main.js exports."""
        text = f"import('/main.js').then(async ({{ page }}) => ({expression}))"
        answer = self.call("Runtime.evaluate", expression=text, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise AssertionError(f"{expression}: {answer['exceptionDetails']['exception'].get('description')}")
        return answer["result"].get("value")

    def text(self, element):
        return self.ask(f"document.getElementById('{element}').innerText")

    def click(self, selector):
        """As a person does: only what is enabled."""
        self.ask(f"document.querySelector('{selector}').click()")

    def drag(self, start, end, steps=8):
        """From one point of the window to another, CSS pixels."""
        def mouse(kind, at):
            self.call("Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], button="left", buttons=1, clickCount=1)
        mouse("mouseMoved", start)
        mouse("mousePressed", start)
        for k in range(1, steps + 1):
            mouse("mouseMoved", [a + (b - a) * k / steps for a, b in zip(start, end)])
        mouse("mouseReleased", end)

    def prefer(self, scheme):
        """"dark" or "light"."""
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def resize(self, width, height, ratio=1):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=ratio, mobile=width < 600)

    def screenshot(self, file):
        data = self.call("Page.captureScreenshot", format="png")["data"]
        Path(file).write_bytes(base64.b64decode(data))
