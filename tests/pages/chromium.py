"""Opens a page in headless Chromium and controls it over the browser's own pipe, with the standard library only.

    with Page("report.html") as page:
        page.evaluate("document.title")
        assert not page.troubles and not page.requests

`troubles` lists console errors, uncaught exceptions and violations of the page's own content security policy. `requests`
lists every requested address that is neither the page itself nor a data URL.
"""
import base64
import json
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

# The exit code if there is no browser: 77 skips the test, but if CI is set, the test fails.
SKIPPED = 1 if os.environ.get("CI") else 77


def browser():
    """Returns the name of the browser's program, or None."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if shutil.which(name):
            return name
    return None


class Page:
    def __init__(self, file, width=1000, height=1400, seconds=60):
        self.address = pathlib.Path(file).resolve().as_uri()
        self.troubles, self.requests = [], []
        self._deadline = time.monotonic() + seconds
        self._number, self._buffer, self._answers, self._loaded = 0, b"", {}, False
        self._profile = tempfile.mkdtemp(prefix="lucerna-page-")
        self._start(width, height)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self._to)
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
        os.close(self._from)
        shutil.rmtree(self._profile, ignore_errors=True)

    def _start(self, width, height):
        # The browser reads commands on descriptor 3 and answers on 4, each message ended by a zero byte.
        command_read, self._to = os.pipe()
        self._from, answer_write = os.pipe()
        os.set_inheritable(command_read, True)
        os.set_inheritable(answer_write, True)
        words = [browser(), "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                 "--no-first-run", "--disable-extensions", f"--user-data-dir={self._profile}",
                 f"--window-size={width},{height}", "--remote-debugging-pipe", "about:blank"]
        shell = f'exec 3<&{command_read} 4>&{answer_write}; exec "$@"'
        self._process = subprocess.Popen(["bash", "-c", shell, "bash", *words], close_fds=False,
                                         stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                         stderr=subprocess.DEVNULL, start_new_session=True)
        os.close(command_read)
        os.close(answer_write)
        os.set_blocking(self._from, False)
        self._session = None
        targets = self._call("Target.getTargets")["targetInfos"]
        target = next(t["targetId"] for t in targets if t["type"] == "page")
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._call(domain + ".enable")
        self._call("Page.navigate", url=self.address)
        while not self._loaded:
            self._receive()

    def _call(self, method, **parameters):
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while self._number not in self._answers:
            self._receive()
        answer = self._answers.pop(self._number)
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']}")
        return answer["result"]

    def _receive(self):
        if time.monotonic() > self._deadline:
            raise TimeoutError("the browser did not answer in time")
        try:
            part = os.read(self._from, 1 << 20)
            if not part:
                raise RuntimeError("the browser ended")
            self._buffer += part
        except BlockingIOError:
            time.sleep(0.01)
        while b"\0" in self._buffer:
            message, self._buffer = self._buffer.split(b"\0", 1)
            self._take(json.loads(message))

    def _take(self, message):
        if "id" in message:
            self._answers[message["id"]] = message
            return
        method, parameters = message["method"], message.get("params", {})
        if method == "Page.loadEventFired":
            self._loaded = True
        elif method == "Runtime.exceptionThrown":
            self.troubles.append(parameters["exceptionDetails"].get("text", "exception"))
        elif method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
            self.troubles.append(str([a.get("value") for a in parameters["args"]]))
        elif method == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
            self.troubles.append(parameters["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            address = parameters["request"]["url"]
            if address != self.address and not address.startswith("data:") and address != "about:blank":
                self.requests.append(address)

    def evaluate(self, script):
        """Returns the value of a script's last expression; a promise is awaited."""
        result = self._call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            details = result["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description", details["text"]))
        return result["result"].get("value")

    def screenshot(self, file):
        """Saves the window's content as a PNG."""
        picture = self._call("Page.captureScreenshot", format="png")["data"]
        pathlib.Path(file).write_bytes(base64.b64decode(picture))

    def prefer(self, scheme):
        """Sets prefers-color-scheme to light or dark."""
        self._call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def mouse(self, kind, x, y, **more):
        """Sends mousePressed, mouseMoved, mouseReleased or mouseWheel at a place of the window."""
        self._call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def key(self, text):
        """Presses the key of a character, or a named key such as ArrowLeft or Enter."""
        typed = {"text": text} if len(text) == 1 else {}
        self._call("Input.dispatchKeyEvent", type="keyDown", key=text, **typed)
        self._call("Input.dispatchKeyEvent", type="keyUp", key=text)


class PageCase(unittest.TestCase):
    """Tests of a page in the temporary folder `folder`, which setUpClass makes and enters as `page`. No test may cause trouble
    or requests."""

    @classmethod
    def tearDownClass(cls):
        cls.page.__exit__()
        cls.folder.cleanup()

    def tearDown(self):
        self.assertEqual(self.page.troubles, [])
        self.assertEqual(self.page.requests, [])
