"""A rig in plans of Bluesky: an ophyd-async device over the station.

    from bluesky import RunEngine
    from bluesky.plans import list_scan
    from ophyd_async.core import init_devices
    from palpate.bluesky import Rig
    from palpate.station import Station

    RE = RunEngine()
    with init_devices():
        rig = Rig(Station("http://127.0.0.1:7480", token))
    RE(list_scan([rig], rig.speed, [1.5, 3.0, 6.0]), print)

A trigger is one run of the armed queue. Its event has the parameters of the fit and the session, whose samples
``palpate export SESSION --bluesky FILE`` writes as documents.
"""
from __future__ import annotations

import asyncio
import math
import time
from dataclasses import dataclass
from typing import Any, Awaitable, Callable, Dict, List, Optional, Sequence

from bluesky.protocols import Hints, Reading
from event_model import DataKey
from ophyd_async.core import DEFAULT_TIMEOUT, AsyncStatus, Device

from .station import Station, StationError, is_over

__all__ = ["Choice", "Rig"]

#: Longest wait of one question in s, so that a cancelled plan leaves no thread behind for longer.
POLL_S = 2.0

#: Keys of an event beside the parameters of the fit: how the run ended, name of its session, its values, why there is no fit.
TEXTS = ("ending", "session", "values", "fit_error")


@dataclass
class Trial:
    """One trigger. After a pause, the next may begin before the last has learned its end."""

    #: Until the station has said that the run is over: where it is silent, the rig may still move.
    may_move: bool = False
    #: By this device, for the run engine.
    is_stopped: bool = False


class Choice(Device):
    """A parameter that may be chosen, in the unit of the armed queue; it begins at the smallest value. Setting it moves nothing."""

    def __init__(self, stop: Callable[[bool], Awaitable[None]], key: DataKey, low: float, high: float, unit: str) -> None:
        # Not the rig itself: a device that is an attribute counts as a part.
        self._stop, self._key = stop, key
        self._low, self._high, self._unit = low, high, unit
        self._value, self._set_at = low, time.time()
        super().__init__()

    @property
    def hints(self) -> Hints:
        return {"fields": [self.name]}

    @property
    def text(self) -> str:
        """Value and unit as a run takes them: digits beyond the ninth come from binary fractions."""
        return f"{self._value:.9g} {self._unit}".strip()

    def check_value(self, value: float) -> None:
        if not self._low <= value <= self._high:
            raise ValueError(f"{self.name} cannot be {value:g} {self._unit}; {self._low:g} to {self._high:g} {self._unit} is armed")

    @AsyncStatus.wrap
    async def set(self, value: float) -> None:
        self.check_value(value)
        self._value, self._set_at = float(value), time.time()

    async def stop(self, success: bool = True) -> None:
        """The run engine stops what a plan has set, which is this and not the rig."""
        await self._stop(success)

    async def read(self) -> Dict[str, Reading[float]]:
        return {self.name: {"value": self._value, "timestamp": self._set_at}}

    async def describe(self) -> Dict[str, DataKey]:
        limits = {"control": {"low": self._low, "high": self._high}}
        return {self.name: {**self._key, "limits": limits}}  # type: ignore[typeddict-item]


class Rig(Device):
    """A rig whose queue is armed. Each parameter that may be chosen is an attribute, such as ``rig.speed``.

    ``parameters`` are those of the fit that events have, each with its standard error, in a record of numbers that has NaN
    where the fit was refused; ``fit_error`` has the reason then. A run that does not finish fails its trigger, so the plan ends
    with ``FailedStatus``. Where a plan is paused, aborted or fails during a run, the rig stops, and a person at it must arm the
    queue again before the plan resumes.
    """

    def __init__(self, station: Station, parameters: Sequence[str] = ("mu1", "tau_eps"), name: str = "") -> None:
        self._station, self._parameters = station, list(parameters)
        self._choices: List[Choice] = []
        self._queue: Optional[Dict[str, Any]] = None
        self._run: Optional[Dict[str, Any]] = None
        self._ended_at = 0.0
        self._trial = Trial()
        super().__init__(name=name)

    async def connect(self, mock: Any = False, timeout: float = DEFAULT_TIMEOUT, force_reconnect: bool = False) -> None:
        """Asks the station what is armed."""
        if mock:
            raise StationError("a rig has no mock; serve the simulated rig with 'palpate serve --time-scale max'")
        armed = await asyncio.to_thread(self._station.armed)
        if armed is None:
            raise StationError("no queue is armed; a person at the rig must arm one")
        self._queue = armed
        self._choices = []
        for name, (low, high, unit) in armed["choose"].items():
            choice = Choice(self.stop, self._key("number", unit), low, high, unit)
            setattr(self, name, choice)
            self._choices.append(choice)
        self.set_name(self.name)
        await super().connect(mock, timeout, force_reconnect)

    def _key(self, dtype: str, unit: str = "") -> DataKey:
        key: Dict[str, Any] = {"source": f"{self._station.url}/api/v1/remote", "dtype": dtype, "shape": []}
        return {**key, "units": unit} if unit else key  # type: ignore[return-value,typeddict-item]

    @property
    def hints(self) -> Hints:
        return {"fields": [f"{self.name}-{one}" for one in self._parameters]}

    @AsyncStatus.wrap
    async def trigger(self) -> None:
        """One run with the chosen values, to its end and its fit."""
        if self._queue is None:
            raise StationError("the device is not connected; use init_devices")
        values = {choice.name[len(self.name) + 1:]: choice.text for choice in self._choices}
        trial = self._trial = Trial(may_move=True)
        self._run = None
        try:
            number = await asyncio.to_thread(self._station.ask, values, "Bluesky", self._queue["queue"])
        except StationError as err:
            # What is refused does not move; without an answer it may.
            trial.may_move = err.status is None
            if trial.is_stopped and err.status is not None:
                return
            raise
        run: Dict[str, Any] = {"state": "waiting", "fit": None}
        while not is_over(run):
            run = await asyncio.to_thread(self._station.run, number, POLL_S)
        trial.may_move = False
        if trial.is_stopped and run["ending"] in ("stop", None):
            return
        if run["ending"] != "finish":
            how = f"ended by {run['ending']}" if run["ending"] else f"was {run['state']}"
            raise StationError(f"run {number} {how}: {run['reason']}")
        self._run, self._ended_at = run, time.time()

    async def stop(self, success: bool = True) -> None:
        """Stops the rig during a run of this device. Between runs it does nothing, for the run engine calls it at the end of every
        plan, and a stop takes the arming back. With `success`, as for a pause, the trigger has not failed: a plan that resumes
        repeats it."""
        if self._trial.may_move:
            self._trial.is_stopped = success
            await asyncio.to_thread(self._station.stop)

    @AsyncStatus.wrap
    async def stage(self) -> None:
        """Nothing to prepare."""

    @AsyncStatus.wrap
    async def unstage(self) -> None:
        """A plan that has set nothing, such as `count`, is stopped here."""
        await self.stop()

    async def pause(self) -> None:
        """The run engine pauses at once."""
        await self.stop()

    async def resume(self) -> None:
        """The plan goes on from its last checkpoint by itself."""

    def _values(self) -> Dict[str, Any]:
        if self._run is None:
            raise StationError("there is no run to read; trigger the rig first")
        found = {one["name"]: one for one in self._run["fit"].get("parameters", [])}
        missing = [name for name in self._parameters if found and name not in found]
        if missing:
            raise StationError(f"the fit has no parameter {missing[0]}; it has {', '.join(found)}")
        values: Dict[str, Any] = {}
        for name in self._parameters:
            one = found.get(name, {})
            for part, number in (("", one.get("value")), ("-std_error", one.get("std_error"))):
                values[name + part] = math.nan if number is None else float(number)
        # As text beside the numbers that the choices have: what was asked for, with its units.
        asked = ", ".join(f"{name} = {text}" for name, text in self._run["values"].items())
        texts = (self._run["ending"], self._run["session"], asked, self._run["fit"].get("error") or "")
        return {**values, **dict(zip(TEXTS, texts))}

    async def read(self) -> Dict[str, Reading[Any]]:
        readings: Dict[str, Reading[Any]] = {}
        for name, value in self._values().items():
            readings[f"{self.name}-{name}"] = {"value": value, "timestamp": self._ended_at}
        # A plan that reads a device does not read its parts once more.
        for choice in self._choices:
            readings.update(await choice.read())
        return readings

    async def describe(self) -> Dict[str, DataKey]:
        fit = (self._run or {}).get("fit") or {}
        units = {one["name"]: one["unit"] for one in fit.get("parameters", [])}
        keys: Dict[str, DataKey] = {}
        for name in self._parameters:
            for part in ("", "-std_error"):
                keys[f"{self.name}-{name}{part}"] = self._key("number", units.get(name, ""))
        for name in TEXTS:
            keys[f"{self.name}-{name}"] = self._key("string")
        for choice in self._choices:
            keys.update(await choice.describe())
        return keys

    async def read_configuration(self) -> Dict[str, Reading[Any]]:
        queue = self._queue or {}
        names = ("queue", "protocol")
        return {f"{self.name}-{one}": {"value": queue.get(one, ""), "timestamp": self._ended_at} for one in names}

    async def describe_configuration(self) -> Dict[str, DataKey]:
        return {f"{self.name}-{name}": self._key("string") for name in ("queue", "protocol")}
