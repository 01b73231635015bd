"""Runs on the simulated rig."""
import signal
import subprocess
import sys

import palpate
import pytest

SHORT = {"depth": 4, "hold": 3, "speed": 3, "seed": 5, "time_scale": "max"}


def test_a_run_is_that_of_the_command(command, tmp_path):
    samples = []
    run = palpate.run("ramp-hold", on_sample=lambda *one: samples.append(one), out=tmp_path / "ours", **SHORT)
    snapshots = list(run)
    assert snapshots[-1]["ending"] == "finish" and snapshots[-1]["fraction"] == 1.0
    times = [one["t_s"] for one in snapshots]
    assert times == sorted(times) and len(samples) == len(snapshots)
    report = command("run", "ramp-hold", "--depth", "4", "--hold", "3", "--speed", "3", "--seed", "5",
                     "--time-scale", "max", "--out", tmp_path / "theirs")
    assert run.report.keys() == report.keys()
    differing = {key for key in report if run.report[key] != report[key]}
    assert differing <= {"session"}
    ours, theirs = run.session.samples("numpy"), palpate.open(tmp_path / "theirs").samples("numpy")
    assert all((ours[name] == theirs[name]).sum() + (ours[name] != ours[name]).sum() == len(ours[name]) for name in ours)


def test_a_run_is_stopped_and_its_data_kept(tmp_path):
    run = palpate.run("ramp-hold", out=tmp_path / "stopped", **{**SHORT, "time_scale": "20"})
    for snapshot in run:
        if snapshot["samples"] > 1000:
            run.stop()
            break
    assert run.wait()["ending"] == "stop"
    assert len(run.session) > 1000 and run.session.end["outcome"] == "stop"


def test_a_closed_run_lets_go_of_the_rig(tmp_path):
    with palpate.run("ramp-hold", rig="sim:bench", out=tmp_path / "first", **{**SHORT, "time_scale": "1"}) as run:
        assert next(run)["ending"] is None
        with pytest.raises(palpate.PalpateError, match="rig bench: "):
            palpate.run("ramp-hold", rig="sim:bench", out=tmp_path / "second", **SHORT)
    assert palpate.run("ramp-hold", rig="sim:bench", out=tmp_path / "third", **SHORT).wait()["ending"] == "finish"
    with pytest.raises(palpate.PalpateError, match="the run has ended"):
        run.stop()


def test_a_run_that_does_not_finish_is_an_error(tmp_path):
    # What is ten times as stiff as tissue trips the interlock of the force.
    run = palpate.run("ramp-hold", out=tmp_path / "hard", **{**SHORT, "depth": 20, "stiffness": 1000})
    with pytest.raises(palpate.PalpateError, match="force interlock: .*; the data so far is in"):
        run.wait()
    assert run.report["ending"] == "interlock" and len(run.session) > 1000


def test_unloading_is_recorded_and_fitted(command, tmp_path):
    # Slow enough for the probe to stay in contact.
    slow = {**SHORT, "depth": 20, "unload": 0.3, "softening": 40, "profile": "ideal"}
    run = palpate.run("ramp-hold", out=tmp_path / "unloaded", **slow)
    run.wait()
    fit = run.session.fit("unloading-3", unload=True)
    theirs = command("fit", tmp_path / "unloaded", "--family", "unloading-3", "--unload")
    assert [one["value"] for one in fit["parameters"]] == pytest.approx([one["value"] for one in theirs["parameters"]], rel=1e-12)


PROGRAM = """
import sys, palpate
run = palpate.run("ramp-hold", out=sys.argv[1])
print(next(run)["phase"], flush=True)
if sys.argv[2] == "interrupted":
    run.wait()
"""


@pytest.mark.parametrize("ending", ["left", "interrupted"])
def test_the_rig_stops_when_its_program_ends(ending, tmp_path):
    process = subprocess.Popen([sys.executable, "-c", PROGRAM, tmp_path / ending, ending], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"self-test\n"
    if ending == "interrupted":
        process.send_signal(signal.SIGINT)
    assert (process.wait(timeout=30) == 0) == (ending == "left")
    process.stdout.close()
    assert palpate.open(tmp_path / ending).end["outcome"] == "stop"


def test_a_run_that_nobody_holds_is_stopped(tmp_path):
    next(palpate.run("ramp-hold", out=tmp_path / "dropped"))
    assert palpate.open(tmp_path / "dropped").end["outcome"] == "stop"
