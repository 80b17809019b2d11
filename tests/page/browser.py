"""A headless Chromium driven over two pipes (Chrome DevTools Protocol), with the standard library alone."""

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time

FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
         "--force-color-profile=srgb"]


class BrowserError(Exception):
    pass


class Browser:
    """One browser with one page. Use as a context manager; the profile is thrown away at the end."""

    def __init__(self, program="chromium", timeout=120.0):
        if not shutil.which(program):
            raise BrowserError(f"'{program}' is not installed; .ci/packages.txt names the package")
        self.timeout = timeout
        self.profile = tempfile.mkdtemp(prefix="fieldlight-page-")
        command_read, self._out = os.pipe()
        self._in, answer_write = os.pipe()
        # Chromium reads commands from descriptor 3 and answers on 4.
        script = 'exec 3<&%d 4>&%d; exec "$0" "$@"' % (command_read, answer_write)
        self.process = subprocess.Popen(
            ["sh", "-c", script, program, *FLAGS, f"--user-data-dir={self.profile}", "--remote-debugging-pipe",
             "about:blank"],
            pass_fds=(command_read, answer_write), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(command_read)
        os.close(answer_write)
        self._buffer = b""
        self._next = 0
        self._session = None
        self.events = []
        try:
            target = self.send("Target.createTarget", url="about:blank")["targetId"]
            self._session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
            for domain in ("Page", "Runtime", "Log", "Network"):
                self.send(f"{domain}.enable")
        except Exception:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self._out)
        os.close(self._in)
        shutil.rmtree(self.profile, ignore_errors=True)

    def send(self, method, **parameters):
        """Runs one command and returns its result; events that arrive meanwhile are kept."""
        self._next += 1
        number = self._next
        message = {"id": number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._out, data):]
        while True:
            answer = self._read()
            if answer.get("id") != number:
                continue
            if "error" in answer:
                raise BrowserError(f"{method}: {answer['error']['message']}")
            return answer["result"]

    def _read(self, timeout=None):
        """The next message; events are kept. Raises on silence."""
        limit = time.monotonic() + (self.timeout if timeout is None else timeout)
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._in], [], [], max(0.0, limit - time.monotonic()))
            chunk = os.read(self._in, 1 << 20) if ready else b""
            if not chunk:
                raise BrowserError("the browser does not answer" if not ready else "the browser ended")
            self._buffer += chunk
        line, self._buffer = self._buffer.split(b"\0", 1)
        message = json.loads(line)
        if "method" in message:
            self.events.append(message)
        return message

    def wait_for(self, method):
        """Waits for an event, unless it is among those that are kept."""
        while not any(event["method"] == method for event in self.events):
            self._read()

    def set_window(self, width, height, dark=False, ratio=1.0):
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=ratio,
                  mobile=False)
        self.send("Emulation.setEmulatedMedia",
                  features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def open_page(self, url, scripts=True):
        """Opens a page, waits until it and its viewer are there."""
        self.send("Emulation.setScriptExecutionDisabled", value=not scripts)
        # A page that differs in its hash alone would not be loaded again.
        for address in ("about:blank", url):
            self.events.clear()
            self.send("Page.navigate", url=address)
            self.wait_for("Page.loadEventFired")
        if scripts:
            self.evaluate("window.fieldlight && window.fieldlight.ready")

    def evaluate(self, expression):
        """The value of a script expression in the page; waits for promises."""
        result = self.send("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            details = result["exceptionDetails"]
            raise BrowserError(details.get("exception", {}).get("description", details["text"]))
        return result["result"].get("value")

    def press(self, key):
        """A key as typed into what has the focus: a letter or a name such as ArrowLeft."""
        text = {"text": key} if len(key) == 1 else {}
        self.send("Input.dispatchKeyEvent", type="keyDown", key=key, **text)
        self.send("Input.dispatchKeyEvent", type="keyUp", key=key)

    def mouse(self, kind, x, y, **more):
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def click(self, x, y):
        for kind in ("mousePressed", "mouseReleased"):
            self.mouse(kind, x, y, button="left", clickCount=1)

    def screenshot(self, whole=False, clip=None):
        """PNG bytes of the window, of the whole page, or of a part (x, y, width, height in CSS pixels of the page)."""
        options = {"format": "png", "captureBeyondViewport": whole or clip is not None}
        if clip:
            options["clip"] = {**dict(zip(("x", "y", "width", "height"), clip)), "scale": 1}
        return base64.b64decode(self.send("Page.captureScreenshot", **options)["data"])

    def page_height(self):
        return self.send("Page.getLayoutMetrics")["cssContentSize"]["height"]

    def complaints(self):
        """Errors and warnings of the console, exceptions, and log entries since the page was opened."""
        found = []
        for event in self.events:
            parameters = event["params"]
            if event["method"] == "Runtime.exceptionThrown":
                found.append(parameters["exceptionDetails"].get("exception", {}).get("description", "exception"))
            elif event["method"] == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
                found.append(str([argument.get("value") for argument in parameters["args"]]))
            elif event["method"] == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
                found.append(parameters["entry"]["text"])
        return found

    def requests(self):
        """Addresses that were asked for since the page was opened, data URIs apart."""
        asked = [event["params"]["request"]["url"] for event in self.events
                 if event["method"] == "Network.requestWillBeSent"]
        return [url for url in asked if not url.startswith("data:")]
