"""Runs of protocols on a rig."""
from __future__ import annotations

import atexit
import json
import weakref
from typing import Any, Callable, Dict, Iterator, List, Optional

from . import _frames
from ._native import NativeRun, PalpateError
from ._session import Session

#: Called with the newest sample of a snapshot: session time in s, depth in mm, force in N.
OnSample = Callable[[float, Optional[float], Optional[float]], None]

_running: "weakref.WeakSet[Run]" = weakref.WeakSet()


@atexit.register
def _stop_all() -> None:
    """No rig moves on when its program is gone."""
    for run in list(_running):
        run.close()


class Run(Iterator[Dict[str, Any]]):
    """A run in progress: iterate over it for snapshots, or :meth:`wait` for its report.

    A run stops when it is interrupted by Ctrl-C, closed, or no longer referred to. After a stop the probe stays where it
    is, and the session is complete up to there.
    """

    def __init__(self, arguments: List[str], on_sample: Optional[OnSample] = None) -> None:
        self._on_sample = on_sample
        self._native: Optional[NativeRun] = NativeRun(arguments)
        #: Remarks, one sentence each.
        self.notes: List[str] = self._native.notes()
        #: The report of the ended run, as ``palpate run --json`` prints it; None while it is in progress.
        self.report: Optional[Dict[str, Any]] = None
        self._failure: Optional[str] = None
        self._is_stopped = False
        _running.add(self)

    def __iter__(self) -> "Run":
        return self

    def __next__(self) -> Dict[str, Any]:
        if self._native is None:
            failure, self._failure = self._failure, None
            if failure is not None and not self._is_stopped:
                raise PalpateError(failure)
            raise StopIteration
        try:
            text, ended = self._native.next()
        except KeyboardInterrupt:
            self.stop()
            raise
        snapshot: Dict[str, Any] = json.loads(text)
        if ended is not None:
            report, notes, self._failure = ended
            self.report = json.loads(report)
            self.notes += notes
            self.close()
        if self._on_sample is not None:
            self._on_sample(snapshot["t_s"], snapshot["depth_mm"], snapshot["force_n"])
        return snapshot

    def __enter__(self) -> "Run":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def wait(self) -> Dict[str, Any]:
        """Waits for the end; the report of the run. A run that did not finish is an error with its reason."""
        for _ in self:
            pass
        if self.report is None:
            raise PalpateError("the run was closed before its end, so there is no report; the session has the data so far")
        return self.report

    @property
    def session(self) -> Session:
        """The recorded session of an ended run."""
        if self.report is None:
            raise PalpateError("the run is in progress; wait for its end before its session is opened")
        return Session(self.report["session"])

    def _choose(self, word: str) -> None:
        if self._native is None:
            raise PalpateError("the run has ended, so there is nothing to answer or to stop")
        self._native.choose(word)

    def stop(self) -> None:
        """Brakes the axis and ends the run; go on iterating until it has ended."""
        self._is_stopped = True
        self._choose("stop")

    def halt(self) -> None:
        """Cuts the motion at once; the axis must be homed again."""
        self._is_stopped = True
        self._choose("halt")

    def pause(self) -> None:
        """Pauses as soon as that is possible without harm."""
        self._choose("pause")

    def resume(self) -> None:
        """Goes on after a pause."""
        self._choose("resume")

    def answer(self, is_done: bool = True) -> None:
        """Answers the prompt of a snapshot: what it asks for is done, or not."""
        self._choose("confirm" if is_done else "decline")

    def close(self) -> None:
        """Stops the rig if the run is still in progress, closes the session and lets go of the rig."""
        _running.discard(self)
        self._native = None


def run(
    protocol: "str | Any", rig: str = "sim", on_sample: Optional[OnSample] = None, **options: "_frames.Option"
) -> Run:
    """Starts a protocol on a rig, in this process, and gives an iterator of snapshots, about thirty a second.

    ``protocol`` is the name of a built-in protocol or a file, ``rig`` is ``"sim"``, ``"sim:NAME"`` or a rig file. Options
    are those of ``palpate run``, with ``_`` for ``-``: ``depth=20``, ``set={"speed": "3 mm/s"}``, ``time_scale="max"``,
    ``out="demo"``, ``about={"specimen.thickness_mm": 12}``, ``acknowledge=True``. ``on_sample`` is called with the time,
    depth and force of the newest sample at each snapshot; the session has every sample.

    A snapshot is a dictionary: ``t_s``, ``phase``, ``fraction`` done, ``time_left_s``, ``depth_mm``, ``force_n``, ``prompt``,
    ``live`` (the fit so far) and others. A run that does not finish ends with a :class:`palpate.PalpateError`.

    >>> with palpate.run("ramp-hold", depth=4, hold=5, seed=3, time_scale="max", out="second") as running:
    ...     phases = {snapshot["phase"] for snapshot in running}
    >>> running.report["ending"], running.session
    ('finish', Session second: ramp-hold, ... samples)
    """
    arguments = _frames.arguments({**options, "rig": rig})
    return Run([*arguments, "--", str(protocol)], on_sample)
