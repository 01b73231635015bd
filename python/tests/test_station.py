"""A program asks for runs of an armed queue, sees the fit of each, and learns why something is refused."""
import http.server
import pathlib
import re
import subprocess
import sys
import threading
import time

import pytest
from palpate import PalpateError
from palpate.station import Station, StationError, is_over

EXAMPLE = pathlib.Path(__file__).resolve().parents[2] / "examples/choose-speed.py"

# Longest wait in s for what a loaded computer does in one.
PATIENCE = 300.0


def until(what, found):
    end = time.monotonic() + PATIENCE
    while not found():
        assert time.monotonic() < end, f"{what} never came"
        time.sleep(0.02)


def refusal(status, call):
    with pytest.raises(StationError) as caught:
        call()
    assert caught.value.status == status, caught.value
    assert isinstance(caught.value, PalpateError)
    return str(caught.value)


def test_a_program_asks_and_gets_the_fit(serve):
    served = serve("--time-scale", "max")
    station = Station(served.url, served.token)
    armed = station.armed()
    assert (armed["queue"], armed["runs_left"], armed["choose"]) == ("speeds of gel 7", 30, {"speed": [1.2, 7.8, "mm/s"]})
    run = station.wait(station.ask({"speed": "3 mm/s"}, "the first"), timeout=PATIENCE)
    assert (run["state"], run["ending"], run["remark"], run["values"]) == ("ended", "finish", "the first", {"speed": "3 mm/s"})
    stiffness = next(one for one in run["fit"]["parameters"] if one["name"] == "mu1")
    assert 0 < stiffness["std_error"] < 0.2 * stiffness["value"]
    assert station.armed()["runs_left"] == 29
    listed = station.sessions()
    assert [one["specimen"] for one in listed] == ["gel 7"] and listed[0]["folder"].endswith(run["session"])
    assert station.state()["run"]["outcome"]["ending"] == "finish"
    assert station.queue()["specimens"] == []


def test_what_is_refused_comes_with_the_sentence_of_the_station(serve):
    served = serve("--time-scale", "max")
    station = Station(served.url, served.token)
    assert "outside what the queue" in refusal(400, lambda: station.ask({"speed": "9 mm/s"}))
    assert "choose among: speed" in refusal(400, lambda: station.ask({"speed": "3 mm/s", "depth": "2 mm"}))
    assert "name that one" in refusal(409, lambda: station.ask({}, queue="another"))
    assert "no run 7" in refusal(404, lambda: station.wait(7))
    # A program on the rig's own computer watches without a token, and starts nothing.
    refusal(403, lambda: Station(served.url).ask({"speed": "3 mm/s"}))
    refusal(401, lambda: Station(served.url, "wrong").state())
    assert station.state()["run"] is None
    served.type("disarm")
    until("the end of the arming", lambda: station.armed() is None)
    assert "a person at the rig took it back" in refusal(409, lambda: station.ask({"speed": "3 mm/s"}))


def test_a_stop_ends_the_run_and_takes_the_arming_back(serve):
    served = serve("--time-scale", "1")
    station = Station(served.url, served.token)
    first, second, third = (station.ask({"speed": "3 mm/s"}) for _ in range(3))
    until("the run", lambda: station.run(first)["session"])
    assert "not over after 0 s" in refusal(None, lambda: station.wait(first, timeout=0))
    assert station.withdraw(third)["state"] == "withdrawn"
    assert station.stop()["is_passed_on"]
    assert station.wait(first, PATIENCE)["ending"] == "stop"
    withdrawn = station.wait(second, PATIENCE)
    assert is_over(withdrawn) and withdrawn["fit"] is None and "arming was taken back" in withdrawn["reason"]
    refusal(409, lambda: station.ask({"speed": "3 mm/s"}))


def test_a_fault_is_an_ending_with_its_reason(serve):
    served = serve("--time-scale", "max", "--stiffness", "1000")
    station = Station(served.url, served.token)
    run = station.wait(station.ask({"speed": "3 mm/s"}), PATIENCE)
    assert run["ending"] == "abort" and run["reason"], run
    assert station.armed() is None


class Elsewhere(http.server.BaseHTTPRequestHandler):
    """A server that is no station, and sends whoever asks to another address."""

    def do_GET(self):
        self.server.asked.append(self.path)
        self.send_response(302)
        self.send_header("Location", "/stolen")
        self.end_headers()

    def log_message(self, *_):
        pass


def test_a_token_follows_no_redirection_and_no_proxy(monkeypatch):
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Elsewhere) as server:
        server.asked = []
        threading.Thread(target=server.serve_forever, daemon=True).start()
        # Nothing listens there.
        monkeypatch.setenv("http_proxy", "http://127.0.0.1:1")
        station = Station(f"http://127.0.0.1:{server.server_port}", "secret")
        assert "not of a palpate station" in refusal(302, station.state)
        assert server.asked == ["/api/v1/state"]
        server.shutdown()


def test_no_answer_and_wrong_addresses_are_sentences():
    assert "does not answer" in refusal(None, Station("http://127.0.0.1:1").state)
    for url in ("rig.lab.example:7480", "ftp://rig", "http://", "http://rig:many", "http://rig/page"):
        assert "address" in refusal(None, lambda: Station(url)), url
    assert "certificate" in refusal(None, lambda: Station("https://rig", certificate="nowhere.pem"))


def test_the_example_chooses_speeds_that_are_allowed(serve):
    pytest.importorskip("sklearn", reason="scikit-learn is not installed")
    served = serve("--time-scale", "max")
    command = [sys.executable, EXAMPLE, "--url", served.url, "--token", served.token, "--runs", "6"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    runs = Station(served.url, served.token)._request("GET", "remote")["runs"]
    speeds = [float(run["values"]["speed"].split()[0]) for run in runs]
    assert len(speeds) == 6 and all(run["ending"] == "finish" for run in runs)
    assert all(1.2 <= speed <= 7.8 for speed in speeds) and len(set(speeds)) >= 3, speeds
    best = re.search(r"best speed: ([\d.]+) mm/s", done.stdout)
    assert best and any(abs(float(best[1]) - speed) < 1e-3 * speed for speed in speeds), done.stdout
    # The figure that it minimises, from its own table.
    rows = [list(map(float, line.split())) for line in done.stdout.splitlines()[1:7]]
    for _, _, seconds, _, error, figure in rows:
        # Digits of the table.
        assert abs(figure - error * (seconds / 60) ** 0.5) < 0.002 + 0.002 * figure, rows
