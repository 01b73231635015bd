"""Sessions, tables and served rigs for the tests, and the command that the package is compared with."""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sysconfig

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
RECORDED = ROOT / "tests/sessions"


@pytest.fixture(scope="session")
def command():
    """Runs the command line with `--json`; its object. PALPATE names another program than the package's own."""
    program = os.environ.get("PALPATE") or pathlib.Path(sysconfig.get_path("scripts")) / "palpate"

    def run(*words, home=None, fails=False):
        environment = dict(os.environ, **({"PALPATE_HOME": str(home)} if home else {}))
        command = [str(program), *map(str, words), "--json"]
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
        assert (done.returncode != 0) == fails, done.stderr
        return json.loads(done.stdout.splitlines()[0])

    run.program = program
    return run


@pytest.fixture(scope="session")
def recorded():
    """A session of the repository, which no test changes."""
    return RECORDED / "ramp-hold-lab"


@pytest.fixture()
def session(recorded, tmp_path):
    """A copy of it, which a test may change."""
    return pathlib.Path(shutil.copytree(recorded, tmp_path / "pig 7"))


@pytest.fixture(scope="session")
def arrays(recorded):
    """Times, depths and forces of its ramp and hold."""
    import palpate

    samples = palpate.open(recorded).samples("numpy", phase="ramp,hold", columns="t_s,depth_mm,force_N")
    return samples["t_s"] - samples["t_s"][0], samples["depth_mm"], samples["force_N"]


@pytest.fixture(scope="session")
def table(arrays, tmp_path_factory):
    """The same as a table with all digits."""
    path = tmp_path_factory.mktemp("tables") / "record.csv"
    rows = (f"{t!r},{depth!r},{force!r}" for t, depth, force in zip(*(column.tolist() for column in arrays)))
    path.write_text("\n".join(["t_s,depth_mm,force_N", *rows, ""]))
    return path


QUEUE = """format = "palpate-remote-queue 1"
name = "speeds of gel 7"
protocol = "ramp-hold"
runs = 30
[labels]
specimen = "gel 7"
[set]
depth = "6 mm"
hold = "20 s"
[choose.speed]
from = "1.2 mm/s"
to = "7.8 mm/s"
"""

# Longest wait in s for a process that is ending: ten times what the slowest took on two busy cores.
PATIENCE = 60.0


class Served:
    """A rig that `palpate serve` serves, with a person who types at it."""

    def __init__(self, program, home, *words):
        self.home, self.queue = home, home / "speeds.toml"
        self.queue.write_text(QUEUE)
        environment = dict(os.environ, PALPATE_HOME=str(home))
        add = [program, "token", "add", "search", "--scope", "watch,stop,run", "--json"]
        self.token = json.loads(subprocess.run(add, env=environment, check=True, capture_output=True).stdout)["token"]
        command = [program, "serve", "--address", "127.0.0.1:0", "--json", *words]
        self.process = subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        assert line, "palpate serve ended"
        self.url = json.loads(line)["url"]

    def type(self, line):
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        self.process.communicate(timeout=PATIENCE)


@pytest.fixture()
def serve(command, tmp_path):
    """Serves the simulated rig with these options; armed, unless `is_armed` is false."""
    served = []

    def start(*words, is_armed=True):
        arming = ("--arm", str(tmp_path / "speeds.toml")) if is_armed else ()
        one = Served(command.program, tmp_path, *arming, *words)
        served.append(one)
        return one

    yield start
    for one in served:
        one.end()
