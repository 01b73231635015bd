"""Sessions and tables for the tests, and the command that the package is compared with."""
import json
import os
import pathlib
import shutil
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
