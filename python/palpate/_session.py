"""Recorded sessions."""
from __future__ import annotations

import json
import math
import numbers
import os
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Union

from . import _fit, _frames, _material
from ._fit import Fit
from ._material import Material
from ._native import NativeSession, PalpateError, fit_session


def _whole(values: Union[None, int, Sequence[int]], what: str) -> List[int]:
    listed = [] if values is None else list(values) if isinstance(values, (list, tuple, range)) else [values]
    # More cycles than a number of 32 bits counts are in no session.
    return [min(_fit.check_whole(number, what), 2**32 - 1) for number in listed]


def _seconds(value: Optional[float], what: str) -> Optional[float]:
    if value is None:
        return None
    if isinstance(value, numbers.Real) and math.isfinite(value):
        return float(value)
    raise PalpateError(f"{what} cannot be {value!r}; give a finite number of seconds")


class Session:
    """A recorded session; :func:`palpate.open` opens one.

    >>> session = palpate.open("demo")
    >>> session
    Session demo: ramp-hold, ... samples
    >>> session.manifest["plan"]["name"]
    'ramp-hold'
    """

    def __init__(self, path: "str | os.PathLike[str]", analysis: Optional[str] = None) -> None:
        #: The session's folder, or the file of its log.
        self.path = Path(path)
        #: Name of the analysis as which it is read; None where it is read as recorded and edited.
        self.analysis = analysis
        self._native = NativeSession(os.fspath(path), analysis)
        self._manifest: Optional[Dict[str, Any]] = None

    def __repr__(self) -> str:
        plan = self.manifest.get("plan")
        name = plan.get("name") if isinstance(plan, dict) else None
        return f"Session {self.path.name}: {name or 'imported'}, {len(self)} samples"

    def __len__(self) -> int:
        """Number of samples."""
        return self._native.sample_count()

    @property
    def manifest(self) -> Dict[str, Any]:
        """Who, what and when: operator, specimen, rig, calibration, plan."""
        if self._manifest is None:
            self._manifest = json.loads(self._native.manifest())
        return self._manifest

    @property
    def end(self) -> Optional[Dict[str, Any]]:
        """How the recording ended; None if it was interrupted."""
        end: Optional[Dict[str, Any]] = json.loads(self._native.end())
        return end

    @property
    def notes(self) -> List[str]:
        """Remarks that a user of the data must know, one sentence each."""
        return self._native.notes()

    @property
    def events(self) -> List[Dict[str, Any]]:
        """Inputs, decisions and live fits of the run, in order, each with its session time in s and the number of
        samples before it.

        >>> found = [one for one in palpate.open("demo").events if one["body"].get("record") == "contact_found"]
        >>> len(found), found[0]["kind"]
        (1, 'decision')
        """
        events: List[Dict[str, Any]] = json.loads(self._native.events())
        return events

    @property
    def edits(self) -> List[Dict[str, Any]]:
        """Verdicts, corrections, tags and notes that were added to the session."""
        edits: List[Dict[str, Any]] = json.loads(self._native.edits())
        return edits

    @property
    def fits(self) -> Dict[str, Fit]:
        """Fits that are stored with the session, by the name of their analysis.

        >>> palpate.open("demo").fit(save="first").name
        'first'
        >>> list(palpate.open("demo").fits)
        ['first']
        """
        stored = [one for one in json.loads(self._native.analyses()) if one["analysis"] == "fit"]
        return {one["name"]: Fit(one["results"], name=one["name"]) for one in stored}

    @property
    def moduli(self) -> Dict[str, Material]:
        """Moduli of every property that are stored with the session, by the name of their analysis."""
        stored = [one for one in json.loads(self._native.analyses()) if one["analysis"] == "material"]
        return {one["name"]: Material(one["results"], one["words"]) for one in stored}

    def samples(
        self,
        frame: Optional[str] = None,
        *,
        columns: Union[None, str, Sequence[str]] = None,
        phase: Union[None, str, Sequence[str]] = None,
        cycle: Union[None, int, Sequence[int]] = None,
        from_s: Optional[float] = None,
        until_s: Optional[float] = None,
        decimate: int = 1,
    ) -> Any:
        """The samples as a data frame, with the columns and values of ``palpate export``.

        ``frame`` is ``"polars"``, ``"pandas"``, ``"arrow"`` (a pyarrow table) or ``"numpy"`` (a dictionary of the numeric
        columns, NaN where a cell is empty); without it the first of polars, pandas and pyarrow that is installed.
        polars and pyarrow read palpate's own memory: no number is copied or turned into text. The metadata of a pyarrow
        table and ``attrs`` of a pandas frame have units and provenance.

        The other arguments select as the options of ``palpate export`` do: names of columns, of phases, cycles,
        seconds since the first sample, and one of every so many samples.

        >>> hold = palpate.open("demo").samples("numpy", phase="hold", columns="t_s,force_N")
        >>> list(hold), bool(hold["force_N"][0] > hold["force_N"][-1])
        (['t_s', 'force_N'], True)
        """
        kind = _frames.chosen(frame)
        selection = {
            "columns": _fit.names_of(columns),
            "phases": _fit.names_of(phase),
            "cycles": _whole(cycle, "cycle"),
            "from_s": _seconds(from_s, "from_s"),
            "until_s": _seconds(until_s, "until_s"),
            "decimate": _fit.check_whole(decimate, "decimate"),
        }
        return _frames.of_table(self._native.samples(selection, kind in ("pandas", "arrow")), kind)

    def fit(
        self,
        family: Optional[str] = None,
        *,
        fixed: Optional[Mapping[str, float]] = None,
        free: Union[None, str, Sequence[str]] = None,
        unload: bool = False,
        profile: bool = False,
        bootstrap: Optional[int] = None,
        seed: int = 1,
        systematic: bool = True,
        include_rejected: bool = False,
        compliance: Optional[str] = None,
        save: Optional[str] = None,
        by: Optional[str] = None,
        reason: str = "",
    ) -> Fit:
        """Fits a force model to ramp and hold, as ``palpate fit SESSION`` does: in what the load cell reported, with the
        uncertainties of noise, zero, contact position and calibration.

        The options are those of the command; ``unload`` fits the unloading too, ``compliance`` corrects the depths, and
        ``save`` stores the fit with the session under that name, for :attr:`fits`.

        >>> fit = palpate.open("demo").fit(fixed={"f0": 0.0})
        >>> fit.parameters["f0"].is_fixed, fit.parameters["mu1"].systematic_error > 0
        (True, True)
        """
        session = {
            "analysis": self.analysis,
            "unload": bool(unload),
            "systematic": bool(systematic),
            "include_rejected": bool(include_rejected),
            "compliance": None if compliance is None else os.fspath(compliance),
            "save": save,
            "by": by,
            "reason": reason,
        }
        requested = _fit.request(family, fixed, free, profile, bootstrap, seed)
        made = _fit.answer(fit_session(os.fspath(self.path), requested, session), save)
        if save is not None:
            # The stored analyses have one more.
            self._native = NativeSession(os.fspath(self.path), self.analysis)
        return made

    def material(self, indenter: str, **options: Any) -> Material:
        """Moduli of the press by a contact law; the options are those of :func:`palpate.material`.

        >>> palpate.open("demo").material("flat-punch", radius=6, poisson=0.49, thickness=60)
        Traceback (most recent call last):
            ...
        palpate.PalpateError: the loading reaches ... mm behind the contact, and the strain is ...
        """
        made = _material.material(self.path, indenter, analysis=self.analysis, **options)
        if options.get("save") is not None:
            self._native = NativeSession(os.fspath(self.path), self.analysis)
        return made


def open(path: "str | os.PathLike[str]", analysis: Optional[str] = None) -> Session:
    """Opens a session folder, or the file of its log, with its edits applied.

    The log is read through once, so a damaged one is refused here; ``analysis`` names a stored analysis of the session,
    whose calibration and excluded stretches are then applied.

    >>> palpate.open("nowhere")
    Traceback (most recent call last):
        ...
    palpate.PalpateError: no session exists at nowhere; check the path
    """
    return Session(path, analysis)
