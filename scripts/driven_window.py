"""The real window on a virtual display, driven by keys and mouse."""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
SIZE = "1360x820"
# Longest wait for anything, in s: ten times what the slowest took on two slow cores.
PATIENCE = 300.0


class Window:
    """The window under the pointer and the keyboard."""

    def __init__(self, binary, out, *arguments):
        self.out = out
        self.library = out / "library"
        self.display, self.xvfb = start_display()
        environment = dict(os.environ, DISPLAY=self.display, PALPATE_HOME=str(self.library), XDG_RUNTIME_DIR=str(out))
        environment.pop("WAYLAND_DISPLAY", None)
        self.environment = environment
        self.process = subprocess.Popen(
            [binary, "window", *arguments], env=environment, stderr=open(out / "stderr.txt", "w")
        )
        self.window = wait_for("the window", self.find)
        self.tool("windowfocus", self.window)
        time.sleep(1.0)

    def find(self):
        found = self.tool("search", "--onlyvisible", "--name", "^palpate$", check=False).split()
        return found[0] if found else None

    def tool(self, *arguments, check=True):
        done = subprocess.run(["xdotool", *arguments], env=self.environment, capture_output=True, text=True, check=check)
        return done.stdout

    def key(self, *names):
        for name in names:
            self.tool("key", name)
            time.sleep(0.15)

    def write(self, text):
        self.tool("type", "--delay", "12", text)
        time.sleep(0.2)

    def by_name(self, words):
        """Asks for something in the palette."""
        self.key("ctrl+k")
        time.sleep(0.3)
        self.write(words)
        self.key("Return")
        time.sleep(0.4)

    def click(self, x, y):
        self.tool("mousemove", str(x), str(y), "click", "1")
        time.sleep(0.3)

    def picture(self, name):
        subprocess.run(
            ["import", "-window", "root", str(self.out / f"{name}.png")], env=self.environment, check=True
        )

    def sessions(self):
        return sorted(path.parent for path in self.library.glob("sessions/*/edits.jsonl"))

    def wait_session(self, count, name):
        """A session is over when its first verdict stands beside it."""
        wait_for(f"session {count} ({name})", lambda: len(self.sessions()) >= count)
        time.sleep(0.5)
        self.picture(name)

    def close(self):
        self.key("ctrl+q")
        code = self.process.wait(timeout=PATIENCE)
        self.xvfb.terminate()
        return code

    def kill(self):
        self.process.kill()
        self.xvfb.terminate()


def start_display():
    reading, writing = os.pipe()
    xvfb = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", f"{SIZE}x24", "-nolisten", "tcp"],
        pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    number = os.fdopen(reading).readline().strip()
    if not number:
        sys.exit("Xvfb did not start")
    return f":{number}", xvfb


def wait_for(what, is_there):
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        found = is_there()
        if found:
            return found
        time.sleep(0.1)
    raise RuntimeError(f"{what} did not come within {PATIENCE:.0f} s")


def check_tools():
    missing = [tool for tool in ("Xvfb", "xdotool", "import") if shutil.which(tool) is None]
    if missing:
        sys.exit(f"{', '.join(missing)} missing; scripts/install-test-tools installs what is needed")


def program(given):
    """The program given, or the development build, made."""
    if given is not None:
        return str(pathlib.Path(given).resolve())
    subprocess.run(["cargo", "build", "--quiet", "-p", "palpate"], cwd=ROOT, check=True)
    metadata = subprocess.run(
        ["cargo", "metadata", "--no-deps", "--format-version", "1"], cwd=ROOT, check=True, capture_output=True
    )
    return str(pathlib.Path(json.loads(metadata.stdout)["target_directory"]) / "debug" / "palpate")
