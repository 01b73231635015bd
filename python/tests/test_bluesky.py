"""Plans of Bluesky on a served rig, with the real run engine; documents that event-model validates."""
import asyncio
import json
import subprocess
import threading
import time

import pytest

pytest.importorskip("bluesky", reason="Bluesky is not installed")
pytest.importorskip("ophyd_async", reason="ophyd-async is not installed")

from bluesky import RunEngine
from bluesky.plans import count, list_scan
from bluesky.utils import FailedStatus, RunEngineInterrupted
from event_model import DocumentNames, schema_validators
from palpate.bluesky import Rig
from palpate.station import Station, StationError

PATIENCE = 300.0


@pytest.fixture()
def engine():
    one = RunEngine(context_managers=[])
    yield one
    if one.state == "paused":
        one.abort()


class Plan:
    """A device on a served rig, and the documents of its plans."""

    def __init__(self, engine, served):
        self.engine, self.station = engine, Station(served.url, served.token)
        self.rig = Rig(self.station, name="rig")
        self.documents = []
        asyncio.run_coroutine_threadsafe(self.rig.connect(), engine.loop).result(PATIENCE)

    def run(self, plan):
        self.engine(plan, lambda name, document: self.documents.append((name, document)))

    def of(self, kind):
        return [document for name, document in self.documents if name == kind]

    def while_it_moves(self, act):
        """Does something once the rig moves, from another thread as a person would."""

        def wait():
            end = time.monotonic() + PATIENCE
            while time.monotonic() < end:
                run = self.station.state()["run"]
                if run and run["outcome"] is None and run["is_motion_possible"]:
                    return act()
                time.sleep(0.02)

        thread = threading.Thread(target=wait)
        thread.start()
        return thread

    def ended(self):
        """How the last run of the rig ended, once it has."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            outcome = self.station.state()["run"]["outcome"]
            if outcome:
                return outcome["ending"]
            time.sleep(0.02)
        raise AssertionError("the rig goes on")


def valid(documents):
    for name, document in documents:
        schema_validators[DocumentNames[name]].validate(document)


def test_a_scan_of_speeds_runs_the_rig_and_its_documents_are_valid(engine, serve, command, tmp_path):
    plan = Plan(engine, serve("--time-scale", "max"))
    plan.run(list_scan([plan.rig], plan.rig.speed, [1.5, 3.0, 6.0]))
    valid(plan.documents)
    events = [event["data"] for event in plan.of("event")]
    assert [event["rig-speed"] for event in events] == [1.5, 3.0, 6.0]
    assert [event["rig-values"] for event in events] == ["speed = 1.5 mm/s", "speed = 3 mm/s", "speed = 6 mm/s"]
    assert all(event["rig-ending"] == "finish" and not event["rig-fit_error"] for event in events)
    assert plan.of("stop")[0]["exit_status"] == "success"
    (descriptor,) = plan.of("descriptor")
    assert descriptor["data_keys"]["rig-speed"]["limits"] == {"control": {"low": 1.2, "high": 7.8}}
    assert descriptor["hints"]["rig"] == {"fields": ["rig-mu1", "rig-tau_eps"]}
    assert descriptor["configuration"]["rig"]["data"] == {"rig-queue": "speeds of gel 7", "rig-protocol": "ramp-hold"}
    # The run engine stops at the end what it has set, and that must not take the arming back.
    assert plan.station.armed()["runs_left"] == 27
    # The events have the numbers of the station, and name sessions that palpate writes as documents of their own.
    runs = [plan.station.run(number) for number in (1, 2, 3)]
    for event, run in zip(events, runs):
        found = {one["name"]: one for one in run["fit"]["parameters"]}
        for name in ("mu1", "tau_eps"):
            assert (event[f"rig-{name}"], event[f"rig-{name}-std_error"]) == (found[name]["value"], found[name]["std_error"])
            assert descriptor["data_keys"][f"rig-{name}"]["units"] == found[name]["unit"]
        written = tmp_path / f"{event['rig-session']}.jsonl"
        export = ["export", tmp_path / "sessions" / event["rig-session"], "--bluesky", written, "--decimate", "100"]
        command(*export, home=tmp_path)
        documents = [json.loads(line) for line in written.read_text().splitlines()]
        valid(documents)
        assert documents[0][1]["sample_name"] == "gel 7"


def test_what_the_rig_cannot_do_fails_before_it_moves(engine, serve):
    plan = Plan(engine, serve("--time-scale", "max"))
    with pytest.raises(FailedStatus) as outside:
        plan.run(list_scan([plan.rig], plan.rig.speed, [9.0]))
    assert "1.2 to 7.8 mm/s is armed" in str(outside.value.__cause__)
    with pytest.raises(FailedStatus) as between:
        plan.run(list_scan([plan.rig], plan.rig.speed, [3.01]))
    assert "multiples of" in str(between.value.__cause__)
    assert plan.station.state()["run"] is None and plan.station.armed()["runs_left"] == 30


def test_a_fault_raises_in_the_plan(engine, serve):
    # Ten times as stiff as the preview expects.
    plan = Plan(engine, serve("--time-scale", "max", "--stiffness", "1000"))
    with pytest.raises(FailedStatus) as caught:
        plan.run(list_scan([plan.rig], plan.rig.speed, [1.5, 3.0, 6.0]))
    assert isinstance(caught.value.__cause__, StationError) and "ended by abort" in str(caught.value.__cause__)
    assert plan.of("stop")[0]["exit_status"] == "fail" and not plan.of("event")
    valid(plan.documents)
    assert plan.station.armed() is None


def test_a_pause_stops_the_rig_and_the_plan_resumes_once_the_queue_is_armed_again(engine, serve):
    served = serve("--time-scale", "4")
    plan = Plan(engine, served)
    thread = plan.while_it_moves(engine.request_pause)
    with pytest.raises(RunEngineInterrupted):
        plan.run(list_scan([plan.rig], plan.rig.speed, [6.0]))
    thread.join()
    assert plan.ended() == "stop" and plan.station.armed() is None
    assert plan.station.run(1, 20)["reason"] == "the operator stopped the run"
    served.type(f"arm {served.queue} 60")
    end = time.monotonic() + PATIENCE
    while plan.station.armed() is None:
        assert time.monotonic() < end, "the arming never came"
        time.sleep(0.02)
    engine.resume()
    valid(plan.documents)
    (event,) = plan.of("event")
    assert event["data"]["rig-ending"] == "finish" and plan.station.run(2)["session"] == event["data"]["rig-session"]


def test_an_abort_stops_the_rig_and_a_plan_does_not_resume_without_an_arming(engine, serve):
    plan = Plan(engine, serve("--time-scale", "1"))
    # A plan that sets nothing: what the run engine has not set, it does not stop.
    thread = plan.while_it_moves(engine.request_pause)
    with pytest.raises(RunEngineInterrupted):
        plan.run(count([plan.rig]))
    thread.join()
    assert plan.ended() == "stop"
    with pytest.raises(FailedStatus) as caught:
        engine.resume()
    assert "no queue is armed (stop over the network" in str(caught.value.__cause__)


def test_a_plan_that_fails_beside_the_rig_stops_it(engine, serve):
    plan = Plan(engine, serve("--time-scale", "1"))
    thread = plan.while_it_moves(engine.abort)
    with pytest.raises(RunEngineInterrupted):
        plan.run(count([plan.rig]))
    thread.join()
    assert plan.ended() == "stop" and plan.of("stop")[0]["exit_status"] == "abort"


def test_a_rig_that_is_not_armed_does_not_connect(engine, serve):
    served = serve("--time-scale", "max", is_armed=False)
    with pytest.raises(StationError, match="no queue is armed"):
        Plan(engine, served)
