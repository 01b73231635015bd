"""Fits of force models, and their reports."""
from __future__ import annotations

import json
import numbers
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from ._native import PalpateError, fit_arrays
from ._report import Report

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike

#: The parameters of the specimen, as the command line calls them together.
_BODY = "body"


@dataclass(frozen=True)
class Parameter:
    """A fitted number with its uncertainty.

    >>> Parameter("tau_eps", 1.0234, "s", std_error=0.0012)
    tau_eps = 1.0234 ± 0.0012 s
    """

    name: str
    value: float
    unit: str
    #: Standard error, the autocorrelation of the residuals allowed for; None where it is fixed or not determined.
    std_error: Optional[float] = None
    #: 95 % interval of the statistical uncertainty.
    ci95: Optional[Tuple[float, float]] = None
    is_fixed: bool = False
    #: Standard uncertainty from calibration and machine compliance; None where it is not known.
    systematic_error: Optional[float] = None
    #: 95 % interval of both together.
    total95: Optional[Tuple[float, float]] = None
    #: Standard uncertainty of each independent source, by its name.
    budget: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def _of(cls, one: Mapping[str, Any]) -> "Parameter":
        def pair(name: str) -> Optional[Tuple[float, float]]:
            ends = one.get(name)
            return None if ends is None else (ends[0], ends[1])

        budget = {entry["source"]: entry["error"] for entry in one.get("budget", ())}
        return cls(
            one["name"],
            one["value"],
            one["unit"],
            one.get("std_error"),
            pair("ci95"),
            one.get("is_fixed", False),
            one.get("systematic_error"),
            pair("total95"),
            budget,
        )

    def __repr__(self) -> str:
        if self.std_error is None:
            return f"{self.name} = {self.value:.6g} {self.unit}" + (" (fixed)" if self.is_fixed else "")
        digits = max(0, 1 - _exponent(self.std_error))
        value = f"{self.value:.{digits}f}" if digits < 12 else f"{self.value:.6g}"
        text = f"{self.name} = {value} ± {self.std_error:.2g} {self.unit}"
        if self.systematic_error is not None:
            text += f" (systematic ± {self.systematic_error:.2g})"
        return text


def _exponent(number: float) -> int:
    """The power of ten of the first digit."""
    return int(f"{abs(number):e}".partition("e")[2])


class Curve:
    """A record along which a model was fitted, as numpy arrays of one length.

    ``force`` is NaN where the measured force does not count; times of a session count from its first sample.
    """

    def __init__(self, t: "np.ndarray", force: "np.ndarray", modelled: "np.ndarray") -> None:
        self.t = t
        self.force = force
        self.modelled = modelled

    def __repr__(self) -> str:
        return f"Curve of {len(self.t)} samples"


class Fit(Report):
    """The report of a fit: a mapping with the content of ``palpate fit --json``, and shortcuts to what is used most.

    >>> fit = palpate.open("demo").fit()
    >>> fit["family"], sorted(fit.parameters)[:3]
    ('series-3', ['f0', 'f_offset', 'mu1'])
    >>> 0.9 < fit.parameters["tau_eps"].value < 1.2
    True
    """

    def __init__(
        self,
        report: Dict[str, Any],
        curves: Sequence[Curve] = (),
        notes: Sequence[str] = (),
        name: Optional[str] = None,
    ) -> None:
        self._report = report
        #: What was fitted, one for each record; empty where the fit was read from a session.
        self.curves: List[Curve] = list(curves)
        #: Remarks on the data.
        self.notes: List[str] = list(notes)
        #: Name of the analysis in the session, or of the record in a joint fit.
        self.name = name

    @property
    def parameters(self) -> Dict[str, Parameter]:
        """The parameters by name; of a joint fit, those of the first record (see :attr:`records`)."""
        report = self._report if "parameters" in self._report else self._report["records"][0]["report"]
        return {one["name"]: Parameter._of(one) for one in report["parameters"]}

    @property
    def records(self) -> List["Fit"]:
        """One fit for each record of a joint fit; of a single record this fit alone."""
        if "parameters" in self._report or "records" not in self._report:
            return [self]
        curves = [[curve] for curve in self.curves] or [[] for _ in self._report["records"]]
        named = zip(self._report["records"], curves)
        return [Fit({**one, **one.get("report", {})}, curve, name=one.get("record")) for one, curve in named]

    @property
    def sentences(self) -> List[str]:
        """Warnings, then findings: what window and command line say about this fit."""
        found = [one for record in self.records for key in ("warnings", "findings") for one in record.get(key, ())]
        return list(dict.fromkeys(found))

    def to_dict(self) -> Dict[str, Any]:
        """The report as a plain dictionary, as in JSON."""
        return self._report

    def _lines(self) -> List[str]:
        shown = self._report
        head = f"{shown.get('model') or shown.get('family')}: {shown.get('samples', 0)} samples"
        if shown.get("rmse_n") is not None:
            head += f", rmse {1e3 * shown['rmse_n']:.3g} mN"
        if shown.get("r2") is not None:
            head += f", R² {shown['r2']:.6f}"
        return [head, *(f"  {one}" for one in self.parameters.values())]

    def __repr__(self) -> str:
        records = self.records
        if len(records) == 1:
            lines = records[0]._lines()
        else:
            shared = ", ".join(self._report.get("shared", ()))
            lines = [f"{len(records)} records together, shared: {shared}"]
            for record in records:
                lines += [f"{record.name}: {record._lines()[0]}", *record._lines()[1:]]
        return "\n".join([*lines, *self.sentences])


def request(
    family: Optional[str],
    fixed: Optional[Mapping[str, float]],
    free: Union[None, str, Sequence[str]],
    profile: bool,
    bootstrap: Optional[int],
    seed: int,
) -> Dict[str, Any]:
    """What the compiled module takes for a fit."""
    for name, value in (fixed or {}).items():
        if isinstance(value, bool) or not isinstance(value, numbers.Real):
            raise PalpateError(f"{name} cannot be fixed at {value!r}; give a number")
    counts = {"seed": seed} if bootstrap is None else {"bootstrap": bootstrap, "seed": seed}
    for name, number in counts.items():
        check_whole(number, name)
    return {
        "family": family,
        "fixed": [(str(name), float(value)) for name, value in (fixed or {}).items()],
        "free": names_of(free),
        "profile": bool(profile),
        "bootstrap": bootstrap,
        "seed": seed,
    }


def check_whole(value: object, what: str) -> int:
    """A whole number from 0, or an error."""
    if not isinstance(value, numbers.Integral) or isinstance(value, bool) or not 0 <= int(value) < 2**63:
        raise PalpateError(f"{what} cannot be {value!r}; give a whole number from 0")
    return int(value)


def names_of(names: Union[None, str, Sequence[str]]) -> List[str]:
    """Names in a list, or in a text with commas."""
    if names is None:
        return []
    return [one.strip() for one in names.split(",")] if isinstance(names, str) else [str(one) for one in names]


def answer(result: Tuple[str, List[Tuple[Any, Any, Any]], List[str]], name: Optional[str] = None) -> Fit:
    """The fit that the compiled module answered with."""
    report, curves, notes = result
    return Fit(json.loads(report), [Curve(*curve) for curve in curves], notes, name)


def _array(values: Any, what: str) -> "np.ndarray":
    import numpy as np

    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise PalpateError(f"{what} is not an array of numbers; give one number for each sample") from None
    if array.ndim != 1:
        raise PalpateError(f"{what} has {array.ndim} dimensions; give one number for each sample")
    return array


def _is_several(values: Any) -> bool:
    import numpy as np

    return isinstance(values, (list, tuple)) and len(values) > 0 and np.ndim(values[0]) > 0


def _sigma(sigma: Any, length: int) -> "Optional[np.ndarray]":
    import numpy as np

    if sigma is None:
        return None
    return np.full(length, float(sigma)) if np.ndim(sigma) == 0 else _array(sigma, "sigma")


def _records(t: Any, depth: Any, force: Any, sigma: Any) -> List[Tuple[Any, Any, Any, Any]]:
    if not _is_several(force):
        record = [_array(values, what) for values, what in ((t, "t"), (depth, "depth"), (force, "force"))]
        return [(*record, _sigma(sigma, len(record[2])))]  # type: ignore[list-item]
    sigmas = list(sigma) if _is_several(sigma) else [sigma] * len(force)
    lists = {"t": t, "depth": depth, "sigma": sigmas}
    for what, values in lists.items():
        if not isinstance(values, (list, tuple)) or len(values) != len(force):
            raise PalpateError(f"force has {len(force)} records, so {what} must be a list of {len(force)} arrays")
    return [record for one in zip(t, depth, force, sigmas) for record in _records(*one)]


def fit(
    t: "ArrayLike | Sequence[ArrayLike]",
    depth: "ArrayLike | Sequence[ArrayLike]",
    force: "ArrayLike | Sequence[ArrayLike]",
    family: Optional[str] = "series-3",
    *,
    sigma: "None | float | ArrayLike | Sequence[ArrayLike]" = None,
    share: Union[None, str, Sequence[str]] = None,
    fixed: Optional[Mapping[str, float]] = None,
    free: Union[None, str, Sequence[str]] = None,
    profile: bool = False,
    bootstrap: Optional[int] = None,
    seed: int = 1,
) -> Fit:
    """Fits a force model to arrays: times in s, depths in mm, forces in N, one of each for every sample.

    Lists of arrays are several records, fitted together: the parameters named in ``share`` are the same in all of them,
    by default all parameters of the specimen (``"body"``).

    ``family`` is a key of the command line, such as ``"maxwell"``, ``"prony-2"`` or ``"unloading-3"``; ``sigma`` the
    standard deviation of the forces (one number, or one for each sample, infinite where a force does not count);
    ``fixed`` holds parameters at values, and ``free`` finds some that are held by default, such as ``"x_contact"``.
    ``profile`` adds intervals of the profile likelihood, ``bootstrap`` those of so many repeats.

    >>> import numpy as np
    >>> t = np.linspace(0, 60, 6001)
    >>> depth = np.minimum(0.75 * t, 20)
    >>> relaxing = 0.05 + 0.05 * np.exp(-t / 4)
    >>> noise = np.random.default_rng(1).normal(0, 0.005, len(t))
    >>> force = np.convolve(np.gradient(depth), relaxing)[:len(t)] + noise
    >>> found = palpate.fit(t, depth, force, family="prony-1", sigma=0.005, fixed={"f_offset": 0})
    >>> found["samples"], round(found.parameters["tau_1"].value, 1)
    (6001, 4.0)
    """
    records = _records(t, depth, force, sigma)
    if share is not None and len(records) < 2:
        raise PalpateError("share needs at least two records; give lists of arrays, one for each record")
    shared = names_of(share) if share is not None else [_BODY]
    return answer(fit_arrays(records, shared, request(family, fixed, free, profile, bootstrap, seed)))
