"""A station and a headless Chromium that watches it."""
import json
import os
import selectors
import shutil
import signal
import socket
import subprocess
import threading
import time
import urllib.error
import urllib.request

from program import skip

# Longest wait for anything, in s: ten times what the slowest took on two slow cores.
PATIENCE = 300.0
UPGRADE = ("GET /api/v1/live?per_second=10 HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
           "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n")


def wait_for(what, attempt):
    end = time.monotonic() + PATIENCE
    while True:
        found = attempt()
        if found:
            return found
        if time.monotonic() > end:
            raise RuntimeError(f"{what} never came")
        time.sleep(0.05)


def lacks_browser(script):
    """Says what is missing, if anything is."""
    for name in ("chromium", "chromedriver"):
        if not shutil.which(name):
            skip("program", name, script)
            return True
    try:
        import selenium  # noqa: F401
    except ImportError:
        skip("python", "selenium", script)
        return True
    return False


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as one:
        return one.getsockname()[1]


def watch(port, count):
    """Watchers that read whatever comes; the bytes that they got so far, in a list of one."""
    selector = selectors.DefaultSelector()
    for _ in range(count):
        watcher = socket.create_connection(("127.0.0.1", port))
        watcher.sendall(UPGRADE.format(port=port).encode())
        selector.register(watcher, selectors.EVENT_READ)
    got = [0]

    def read():
        while True:
            for key, _ in selector.select():
                data = key.fileobj.recv(1 << 20)
                got[0] += len(data)
                if not data:
                    selector.unregister(key.fileobj)

    threading.Thread(target=read, daemon=True).start()
    return got


class Station:
    """A command of palpate that serves a rig."""

    def __init__(self, binary, library, *words, url):
        self.url = url
        self.library = library
        environment = dict(os.environ, PALPATE_HOME=str(library))
        self.errors = open(library / "stderr.txt", "w")
        self.process = subprocess.Popen([binary, *words], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        stderr=self.errors, text=True)

    def ask(self, path, method="GET", token=None, body=None):
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        data = None
        if body is not None:
            headers["Content-Type"] = "application/json"
            data = json.dumps(body).encode()
        request = urllib.request.Request(self.url + path, method=method, headers=headers, data=data)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)

    def serves(self):
        try:
            return self.ask("/api/v1/health")["is_runner_alive"]
        except (urllib.error.URLError, OSError):
            if self.process.poll() is not None:
                raise RuntimeError(f"palpate ended: {(self.library / 'stderr.txt').read_text()}")
            return False

    def wait(self):
        """Until it has ended by itself; its exit code and what it printed."""
        printed, _ = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, printed

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            self.process.communicate(timeout=PATIENCE)
        self.errors.close()


class Browser:
    """A headless Chromium with the station's page."""

    def __init__(self, size=(412, 915)):
        from selenium import webdriver

        options = webdriver.ChromeOptions()
        for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--ignore-certificate-errors",
                     f"--window-size={size[0]},{size[1]}"):
            options.add_argument(word)
        options.binary_location = shutil.which("chromium")
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        service = webdriver.ChromeService(executable_path=shutil.which("chromedriver"))
        self.driver = webdriver.Chrome(options=options, service=service)

    def open(self, url):
        self.driver.get(url)

    def text(self, name):
        return self.driver.find_element("id", name).text

    def attribute(self, name, attribute):
        return self.driver.find_element("id", name).get_attribute(attribute)

    def press(self, name):
        self.driver.find_element("id", name).click()

    def until(self, what, attempt):
        try:
            return wait_for(what, attempt)
        except RuntimeError:
            self.driver.save_screenshot("palpate-browser.png")
            raise RuntimeError(f"{what} never came; the page shows: {self.driver.find_element('tag name', 'body').text}")

    def complaints(self):
        """What the page or the browser's rules for it found wrong."""
        return [line["message"] for line in self.driver.get_log("browser") if line["level"] == "SEVERE"]

    def close(self):
        self.driver.quit()
