"""A headless Chromium over its DevTools protocol: opens a page, clicks, reads, takes pictures."""

import base64
import itertools
import json
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

from websockets.sync.client import connect

NAMES = ("chromium", "chromium-browser", "google-chrome")
BOUND = 180.0  # [s] for anything of the browser's
POLL = 0.05  # [s]
# Software draws slowly on a busy machine: a GPU process that is taken for hung is started anew, without the
# picture.
OPTIONS = (
    "--disable-gpu-watchdog", "--disable-hang-monitor",
    "--headless=new", "--no-sandbox", "--disable-gpu-sandbox", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--remote-debugging-port=0", "--no-first-run", "--disable-extensions",
    "--disable-dev-shm-usage", "--disable-background-networking",
)  # fmt: skip


def find_browser():
    """Returns the path of a Chromium, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None)


def wait_for(look, what):
    """Returns the first true value of `look`."""
    deadline = time.monotonic() + BOUND
    while not (found := look()):
        assert time.monotonic() < deadline, f"no {what} in {BOUND:g} s"
        time.sleep(POLL)
    return found


class Output:
    """What a program writes, line by line."""

    def __init__(self, *command, **options):
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
            **options,
        )  # fmt: skip
        self.lines = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(line.rstrip())

    def line(self, text):
        """Returns the first line with `text` in it, once it is there."""
        found = wait_for(
            lambda: [each for each in self.lines if text in each] or self.process.poll() is not None,
            f"line {text!r}",
        )
        assert found is not True, self.lines
        return found[0]

    @property
    def url(self):
        """Where its page is."""
        return self.line("is the page").rpartition(" ")[2]

    def close(self, number=signal.SIGTERM):
        """Ends it by a signal; returns its exit code."""
        self.process.send_signal(number)
        code = self.process.wait(BOUND)
        self._reader.join(BOUND)
        self.process.stdout.close()
        return code


class Browser:
    """One page. A context manager."""

    def __init__(self, url, offline=False, size=(1280, 800)):
        self._url, self._offline, self._size = url, offline, size
        self._ids = itertools.count(1)
        self.log = []  # what the page wrote to its console
        self.requests = []  # addresses that it asked for, from the moment on in which it is offline

    def __enter__(self):
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._process = subprocess.Popen(
            [find_browser(), *OPTIONS, f"--window-size={self._size[0]},{self._size[1]}",
             f"--user-data-dir={self._folder.name}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            told = Path(self._folder.name, "DevToolsActivePort")
            wait_for(lambda: told.is_file() and told.read_text().count("\n"), "browser")
            port = told.read_text().split()[0]
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=BOUND) as answer:
                (page,) = [each for each in json.load(answer) if each["type"] == "page"]
            self._socket = connect(page["webSocketDebuggerUrl"], max_size=None)
            self._do("Runtime.enable")
            self._do("Page.enable")
            if self._offline:
                self._do("Network.enable")
                self._do("Network.emulateNetworkConditions", offline=True, latency=0,
                         downloadThroughput=-1, uploadThroughput=-1)  # fmt: skip
            self._do("Page.navigate", url=self._url)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_fault):
        self._process.kill()
        self._process.wait()
        self._folder.cleanup()

    def _do(self, method, **parameters):
        number = next(self._ids)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._socket.recv(timeout=BOUND))
            if answer.get("method") in ("Runtime.consoleAPICalled", "Runtime.exceptionThrown"):
                self.log.append(answer["params"])
            if answer.get("method") == "Network.requestWillBeSent":
                self.requests.append(answer["params"]["request"]["url"])
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]

    def resize(self, width, height):
        """Gives the page a size [pixels]: a window has a frame, and a least width."""
        self._do("Emulation.setDeviceMetricsOverride", width=width, height=height,
                 deviceScaleFactor=1, mobile=False)  # fmt: skip

    def run(self, script):
        """Returns the value of a JavaScript expression."""
        answer = self._do("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    @property
    def text(self):
        """All text that the page shows."""
        return self.run("document.body ? document.body.innerText : ''")

    def wait_for_text(self, text):
        try:
            wait_for(lambda: text in self.text, f"text {text!r}")
        except AssertionError as fault:  # as of a blank page, whose console may say why
            raise AssertionError(f"{fault}; {self.text[:500]!r}; {self.log[-5:]}") from None

    def type(self, selector, text):
        """Types a text into the first input of a CSS selector, in place of what it has."""
        self.run(
            f"""(() => {{
              const input = document.querySelector({json.dumps(selector)});
              const value = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value");
              value.set.call(input, {json.dumps(text)});
              input.dispatchEvent(new Event("input", {{bubbles: true}}));
            }})()"""
        )

    def reload(self):
        """Opens the page anew: it is seen as at first. Returns once the old one has gone."""
        before = self._document()
        self._do("Page.reload")
        wait_for(lambda: self._document() != before, "new document")

    def _document(self):
        return self._do("Page.getFrameTree")["frameTree"]["frame"]["loaderId"]

    def wait_for_value(self, value):
        """Waits until a field or a list shows `value`."""
        wait_for(lambda: self._middle(f"e.value === {json.dumps(value)}"), f"value {value!r}")

    def download_to(self, folder):
        """Has the page's downloads go to a folder; each is there as soon as it is whole."""
        self._do("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))

    def choose(self, now, wanted):
        """Chooses `wanted` in the list that shows `now`."""
        wait_for(lambda: self._press(f"e.value === {json.dumps(now)}"), f"list {now!r}")
        self.click(wanted)
        self.wait_for_value(wanted)
        open_lists = "[...document.querySelectorAll('[role=option]')].some(e => e.offsetParent)"
        wait_for(lambda: not self.run(open_lists), "closed list")

    def click(self, text):
        """Clicks the element with that text, in the middle, as a mouse does."""
        found = f"e.innerText && e.innerText.trim() === {json.dumps(text)}"
        wait_for(lambda: self._press(found), f"element {text!r}")

    def key(self, kind, key):
        """Holds a letter's key, or lets it go: "keyDown" or "keyUp"."""
        self._do("Input.dispatchKeyEvent", type=kind, key=key, code=f"Key{key.upper()}")

    def push_slider(self, label, key, count):
        """Presses a key some times on the slider beside a label."""
        element = self._slider(label)
        wait_for(lambda: self.run(f"!!{element} && ({element}.focus(), true)"), element)
        for _ in range(count):
            for kind in ("keyDown", "keyUp"):
                self._do("Input.dispatchKeyEvent", type=kind, key=key, code=key)

    def is_off(self, label):
        """Whether the slider beside a label is switched off."""
        return self.run(f"{self._slider(label)}?.ariaDisabled") == "true"

    def _slider(self, label):
        return f"""(() => {{
          let e = [...document.querySelectorAll("label")]
            .find(e => e.innerText.trim() === {json.dumps(label)});
          while (e && !e.querySelector("[role=slider]")) e = e.parentElement;
          return e && e.querySelector("[role=slider]");
        }})()"""

    def _press(self, condition):
        """Presses in the middle of an element; whether it was there: layout moves elements away."""
        place = self._middle(condition)
        if not place:
            return False
        for kind in ("mousePressed", "mouseReleased"):
            self._do("Input.dispatchMouseEvent", type=kind, button="left", clickCount=1, **place)
        return self.run("window.met")

    def _middle(self, condition):
        """Where the first visible element is that a JavaScript condition on `e` holds for, once it rests."""
        return self.run(
            f"""(() => {{
              const kinds = "button, label, input, [role=tab], [role=option], p";
              const found = [...document.querySelectorAll(kinds)]
                .filter(e => e.offsetParent && ({condition}))
                .filter((e, _, all) => !all.some(other => other !== e && e.contains(other)));
              const moving = document.getAnimations().filter(
                a => a.playState === "running" && a.effect.target.contains(found[0]));
              if (!found.length || moving.length) return null;
              found[0].scrollIntoView({{block: "center"}});
              window.met = false;
              document.onmousedown = event => {{ window.met = found[0].contains(event.target); }};
              const box = found[0].getClientRects()[0];  // of a text in lines, the first one
              return {{x: box.x + box.width / 2, y: box.y + box.height / 2}};
            }})()"""
        )

    def screenshot(self, path=None):
        """Returns a PNG of the page as it is shown, and writes it to `path`."""
        content = base64.b64decode(self._do("Page.captureScreenshot", format="png")["data"])
        if path is not None:
            Path(path).write_bytes(content)
        return content
