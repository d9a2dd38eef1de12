"""A headless Chromium, driven through its DevTools protocol over a pipe: keys, pointer, downloads.

No driver package is needed: messages are JSON, separated by zero bytes, on the file descriptors 3
(to the browser) and 4 (from it).
"""

import base64
import json
import os
import re
import select
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import pytest

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
FLAGS = (
    "--headless=new",
    "--remote-debugging-pipe",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--disable-extensions",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--no-default-browser-check",
    "--hide-scrollbars",
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
    "--no-proxy-server",
)
KEYS = {
    "Tab": 9, "Enter": 13, "Escape": 27, "End": 35, "Home": 36,
    "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, " ": 32,
}  # fmt: skip
START, ANSWER = 40.0, 30.0  # longest waits [s]
CONTRAST = """
(() => {
  const colour = (words) => {
    const n = (words.match(/[\\d.]+/g) || []).map(Number);
    const scale = words.startsWith("color(") ? 255 : 1;
    return n.length < 3 ? [0, 0, 0, 0] : [...n.slice(0, 3).map((v) => v * scale), n[3] ?? 1];
  };
  const over = (top, below) => {
    const mixed = [0, 1, 2].map((k) => top[3] * top[k] + (1 - top[3]) * below[k]);
    return [...mixed, 1];
  };
  const luminance = (rgb) => [0.2126, 0.7152, 0.0722].reduce((sum, weight, k) => {
    const v = rgb[k] / 255;
    return sum + weight * (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  }, 0);
  const ancestors = (node) => node ? [node, ...ancestors(node.parentElement)] : [];
  const opacity = (node) =>
    ancestors(node).reduce((all, n) => all * getComputedStyle(n).opacity, 1);
  const painted = (fill, alpha) => [...fill.slice(0, 3), fill[3] * alpha];
  const behind = (node) => ancestors(node).reverse().reduce(
    (below, n) => over(colour(getComputedStyle(n).backgroundColor), below), [255, 255, 255, 1]);
  const shapesBehind = (text, middle, below) => {
    const { stroke, paintOrder } = getComputedStyle(text);
    if (stroke !== "none" && paintOrder.startsWith("stroke")) return colour(stroke); // a halo
    for (const shape of text.ownerSVGElement.querySelectorAll("path, rect, circle, polygon")) {
      const look = getComputedStyle(shape), matrix = shape.getScreenCTM();
      if (shape.closest("clipPath") || look.fill === "none" || !matrix) continue;
      if (!(shape.compareDocumentPosition(text) & Node.DOCUMENT_POSITION_FOLLOWING)) continue;
      if (!shape.isPointInFill(middle.matrixTransform(matrix.inverse()))) continue;
      below = over(painted(colour(look.fill), look.fillOpacity * opacity(shape)), below);
    }
    return below;
  };
  const read = [];
  for (const node of document.querySelectorAll("body *")) {
    const own = [...node.childNodes].filter((n) => n.nodeType === Node.TEXT_NODE);
    const words = own.map((n) => n.data.trim()).join(" ").trim();
    const box = node.getBoundingClientRect();
    if (!words || !box.width || !node.checkVisibility({ visibilityProperty: true })) continue;
    if (node.closest(".hidden, noscript, script, style, option, :disabled")) continue;
    const style = getComputedStyle(node), drawn = node.ownerSVGElement;
    const middle = new DOMPoint(box.x + box.width / 2, box.y + box.height / 2);
    const below = drawn ? shapesBehind(node, middle, behind(drawn)) : behind(node);
    const ink = painted(colour(drawn ? style.fill : style.color), opacity(node));
    const [low, high] = [luminance(over(ink, below)), luminance(below)].sort((a, b) => a - b);
    const large = parseFloat(style.fontSize) >= (style.fontWeight >= 700 ? 18.66 : 24);
    read.push({ words, ratio: (high + 0.05) / (low + 0.05), least: large ? 3 : 4.5 });
  }
  return read;
})()
"""
"""Contrast of every text on a page with what lies behind it, and the least by WCAG 2.2, 1.4.3."""


class Browser:
    """One page in a browser; everything that it complains of or asks the network for is noted."""

    def __init__(self):
        program = next(filter(None, map(shutil.which, PROGRAMS)), None)
        if os.name != "posix" or program is None:
            pytest.skip("there is no Chromium on this machine to open the page in")
        self.folder = Path(tempfile.mkdtemp(prefix="deboom-browser-"))
        self.downloads = self.folder / "downloads"
        self.complaints, self.requests, self._count, self._rest = [], [], 0, b""
        to_browser, from_browser = os.pipe(), os.pipe()
        self._out, self._in = to_browser[1], from_browser[0]
        command = [program, *FLAGS, f"--user-data-dir={self.folder / 'profile'}", "about:blank"]
        # the shell gives the pipes the numbers that the browser expects
        lines = f'exec "$@" 3<&{to_browser[0]} 4>&{from_browser[1]}'
        self._process = subprocess.Popen(
            ["bash", "-c", lines, "browser", *command],
            pass_fds=(to_browser[0], from_browser[1]),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        os.close(to_browser[0])
        os.close(from_browser[1])
        self._session = None
        try:
            targets = self._send("Target.getTargets", wait=START)["targetInfos"]
        except (BrokenPipeError, EOFError, TimeoutError):
            self.close()
            pytest.skip(f"{program} does not start on this machine")
        page = next(target["targetId"] for target in targets if target["type"] == "page")
        attached = self._send("Target.attachToTarget", targetId=page, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._send(f"{domain}.enable")
        self._send(
            "Browser.setDownloadBehavior", behavior="allow", downloadPath=str(self.downloads)
        )

    def close(self):
        """End the browser and take its folder away."""
        if self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        os.close(self._out)
        os.close(self._in)
        shutil.rmtree(self.folder, ignore_errors=True)

    def open(self, path, width=1280, height=900):
        """Load a file."""
        self.complaints.clear()
        self.requests.clear()
        self.resize(width, height)
        self._send("Page.navigate", url=path.resolve().as_uri())
        self.wait("document.readyState === 'complete' && location.protocol === 'file:'")

    def open_address(self, address, width=1440, height=900):
        """Load a page of a server."""
        self.complaints.clear()
        self.requests.clear()
        self.resize(width, height)
        self._send("Page.navigate", url=address)
        self.wait("document.readyState === 'complete' && location.protocol === 'http:'")

    def resize(self, width, height=900):
        """Give the window another size [px]."""
        self._send(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=False,
        )  # fmt: skip

    def picture(self):
        """Return what the window shows, as PNG."""
        return base64.b64decode(self._send("Page.captureScreenshot", format="png")["data"])

    def printed_pages(self):
        """Return how many pages the page has on paper, by its own size of paper."""
        sent = self._send("Page.printToPDF", preferCSSPageSize=True, printBackground=True)
        return len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(sent["data"])))

    def scripts(self, allowed):
        """Switch JavaScript on or off for pages opened from now on."""
        self._send("Emulation.setScriptExecutionDisabled", value=not allowed)

    def value(self, expression):
        """Evaluate JavaScript."""
        answer = self._send("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait(self, expression, seconds=ANSWER):
        """Wait until an expression is true, for so many seconds at most."""
        end = time.monotonic() + seconds
        while not self.value(expression):
            assert time.monotonic() < end, f"never true: {expression}"
            time.sleep(0.02)

    def contrasts(self):
        """Return how many texts are to be read, and those with too little contrast."""
        read = self.value(CONTRAST)
        return len(read), [text for text in read if text["ratio"] < text["least"]]

    def text(self, selector):
        """Return the words of an element."""
        return self.value(f"document.querySelector({json.dumps(selector)}).textContent")

    def focus(self, selector):
        """Focus an element."""
        self.value(f"document.querySelector({json.dumps(selector)}).focus()")

    def key(self, name, times=1, shift=False):
        """Press a key."""
        text = {"Enter": "\r", " ": " "}.get(name)
        for _ in range(times):
            for kind in ("keyDown", "keyUp"):
                extra = {"text": text} if text and kind == "keyDown" else {}
                self._send(
                    "Input.dispatchKeyEvent",
                    type=kind, key=name, code="Space" if name == " " else name,
                    windowsVirtualKeyCode=KEYS[name], modifiers=8 if shift else 0, **extra,
                )  # fmt: skip

    def drag(self, *points):
        """Press the button at the first point, move through the others, and let it go [px]."""
        for place, (x, y) in enumerate((points[0], *points, points[-1])):
            first, last = place == 0, place == len(points) + 1
            kind = "mousePressed" if first else "mouseReleased" if last else "mouseMoved"
            button = {"button": "left", "buttons": 1, "clickCount": 1}
            self._send("Input.dispatchMouseEvent", type=kind, x=x, y=y, **button)

    def downloaded(self, name):
        """Wait for a file and return its text."""
        path, end = self.downloads / name, time.monotonic() + ANSWER
        while not path.is_file():
            assert time.monotonic() < end, f"{name} was not saved"
            time.sleep(0.02)
        return path.read_text(encoding="utf-8-sig")

    def _send(self, method, wait=ANSWER, **parameters):
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        if self._session and not method.startswith(("Target.", "Browser.")):
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        end = time.monotonic() + wait
        while True:
            answer = self._read(end)
            if answer.get("id") == self._count:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]
            self._note(answer.get("method"), answer.get("params"))

    def _read(self, end):
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._in], [], [], max(0.0, end - time.monotonic()))
            if not ready:
                raise TimeoutError("the browser does not answer")
            got = os.read(self._in, 1 << 20)
            if not got:
                raise EOFError("the browser has ended")
            self._rest += got
        message, _, self._rest = self._rest.partition(b"\0")
        return json.loads(message)

    def _note(self, method, parameters):
        if method == "Runtime.exceptionThrown":
            self.complaints.append(parameters["exceptionDetails"])
        elif method == "Runtime.consoleAPICalled":
            self.complaints.append(parameters["args"])
        elif method == "Log.entryAdded":
            self.complaints.append(parameters["entry"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])
