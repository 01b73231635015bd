"""Decisions from outside: a program asks a station for runs of a queue that a person at the rig has armed, sees the fit of
each, and chooses the next.

    from palpate.station import Station

    station = Station("http://127.0.0.1:7480", token)
    run = station.wait(station.ask({"speed": "3 mm/s"}))
    run["ending"], run["fit"]["parameters"][0]["std_error"]

``palpate serve --arm FILE`` serves and arms a rig, ``palpate token add NAME --scope watch,run`` makes a token. Answers are the
mappings of the station's ``/api/v1/openapi.json``. Nothing is asked twice: where a station does not answer, that is an error.
"""
from __future__ import annotations

import http.client
import json
import os
import ssl
import time
from typing import Any, Dict, List, Mapping, Optional
from urllib.parse import urlsplit

from ._native import PalpateError

__all__ = ["Station", "StationError", "is_over"]

#: Longest wait of one question in s; the station allows 25.
WAIT_MAX_S = 20.0

#: Time for an answer beyond that wait in s: a station on two busy cores answers within 2.
ANSWER_S = 10.0

#: Time for a stop in s. Whoever waits longer walks to the emergency stop.
STOP_S = 5.0


class StationError(PalpateError):
    """What a station refuses, in its own sentence, or why it gives no answer."""

    def __init__(self, sentence: str, status: Optional[int] = None) -> None:
        super().__init__(sentence)
        #: The status of HTTP, such as 409 where no queue is armed; None where there was no answer.
        self.status = status


def is_over(run: Mapping[str, Any]) -> bool:
    """Whether nothing more happens to a run: it has ended and is fitted, or it never started."""
    return run["fit"] is not None if run["state"] == "ended" else run["state"] in ("refused", "withdrawn")


def _failure(status: int, content: bytes) -> StationError:
    try:
        sentence = json.loads(content)["error"]
    except (ValueError, KeyError, TypeError):
        sentence = f"the answer with the status {status} is not of a palpate station; check the address"
    return StationError(str(sentence), status)


class Station:
    """A rig that is served by ``palpate serve``, ``palpate run --serve`` or the window.

    ``certificate`` is a file with the certificate of the station, where the system does not know who has signed it. No
    proxy is used and no redirection followed, so that the token goes to the station alone.
    """

    def __init__(self, url: str, token: Optional[str] = None, certificate: "None | str | os.PathLike[str]" = None) -> None:
        parts = urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.path not in ("", "/"):
            raise StationError(f"'{url}' is not the address of a station; give one such as http://127.0.0.1:7480")
        try:
            self._port = parts.port
            self._tls = ssl.create_default_context(cafile=certificate) if parts.scheme == "https" else None
        except (OSError, ValueError) as err:
            raise StationError(f"{url}: {err}; check the address and the file of the certificate") from err
        self._host = parts.hostname
        self._token = token
        #: Its address, without a slash at the end.
        self.url = url.rstrip("/")

    def __repr__(self) -> str:
        return f"Station {self.url}"

    def _connection(self, timeout: float) -> http.client.HTTPConnection:
        if self._tls is None:
            return http.client.HTTPConnection(self._host, self._port, timeout=timeout)
        return http.client.HTTPSConnection(self._host, self._port, timeout=timeout, context=self._tls)

    def _request(self, method: str, path: str, content: Any = None, timeout: float = ANSWER_S) -> Dict[str, Any]:
        headers = {"Authorization": f"Bearer {self._token}"} if self._token else {}
        text = None if content is None else json.dumps(content).encode()
        if text is not None:
            headers["Content-Type"] = "application/json"
        connection = self._connection(timeout)
        try:
            connection.request(method, f"/api/v1/{path}", text, headers)
            response = connection.getresponse()
            status, received = response.status, response.read()
        except (OSError, http.client.HTTPException, ValueError) as err:
            raise StationError(f"the station {self.url} does not answer ({err}); check the rig and the network") from err
        finally:
            connection.close()
        if status not in (200, 201):
            raise _failure(status, received)
        try:
            answer: Dict[str, Any] = json.loads(received)
        except ValueError as err:
            raise StationError(f"the answer of {self.url} is not JSON; check the address", status) from err
        return answer

    def state(self) -> Dict[str, Any]:
        """State of the rig, and of its run."""
        return self._request("GET", "state")

    def stop(self) -> Dict[str, Any]:
        """Stops the rig and takes the arming back. A stop over a network is best effort: rely on the emergency stop."""
        return self._request("POST", "stop", timeout=STOP_S)

    def sessions(self, limit: int = 20, skip: int = 0) -> List[Dict[str, Any]]:
        """Sessions of the rig's library, the latest first."""
        found: List[Dict[str, Any]] = self._request("GET", f"sessions?limit={limit:d}&skip={skip:d}")["sessions"]
        return found

    def queue(self) -> Dict[str, Any]:
        """The rig's queue of specimens, which people fill; :meth:`armed` is what programs may ask for."""
        return self._request("GET", "queue")

    def armed(self) -> Optional[Dict[str, Any]]:
        """What is armed: name of the queue, runs left, and smallest value, largest value and unit of each parameter that may
        be chosen. None where nothing is."""
        armed: Optional[Dict[str, Any]] = self._request("GET", "remote")["armed"]
        return armed

    def ask(self, values: Mapping[str, str], remark: str = "", queue: Optional[str] = None) -> int:
        """Asks for a run with values such as ``{"speed": "3 mm/s"}``; its number, for :meth:`wait`.

        ``queue`` is the name of the armed queue; without it, whichever is armed. The refusal of a value says what is allowed.
        """
        if queue is None:
            # A station without an arming says in its refusal why there is none.
            queue = (self.armed() or {"queue": ""})["queue"]
        asked = self._request("POST", "remote/runs", {"queue": queue, "values": dict(values), "remark": remark})
        number: int = asked["id"]
        return number

    def run(self, number: int, wait_s: float = 0.0) -> Dict[str, Any]:
        """A run that was asked for, once it is over or after this time in s, at most 25."""
        return self._request("GET", f"remote/runs/{number:d}?wait_s={wait_s:.3f}", timeout=wait_s + ANSWER_S)

    def wait(self, number: int, timeout: Optional[float] = None) -> Dict[str, Any]:
        """Waits for the end of a run and its fit. After the timeout in s the run goes on, and this is an error.

        Look at ``state`` and ``ending``: a run that was stopped or aborted is an answer too, with its ``reason``.
        """
        end = None if timeout is None else time.monotonic() + timeout
        while True:
            left = WAIT_MAX_S if end is None else max(0.0, min(WAIT_MAX_S, end - time.monotonic()))
            run = self.run(number, left)
            if is_over(run):
                return run
            if end is not None and time.monotonic() >= end:
                raise StationError(f"run {number} is not over after {timeout:g} s; wait longer, or stop the rig")

    def withdraw(self, number: int) -> Dict[str, Any]:
        """Takes back a run that waits."""
        return self._request("DELETE", f"remote/runs/{number:d}")
