"""Moduli of a press by a contact law."""
from __future__ import annotations

import json
import numbers
import os
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Tuple, Union

from . import _fit
from ._native import PalpateError, fit_material
from ._report import Report

if TYPE_CHECKING:
    import numpy as np

#: A number that is taken as exact, or a number and its standard uncertainty.
Quantity = Union[float, Tuple[float, float]]

#: The indenters of the command line, each with its fields.
_INDENTERS: Dict[str, Dict[str, str]] = {
    "flat-punch": {"shape": "flat-punch"},
    "sphere": {"shape": "sphere"},
    "cone": {"shape": "cone"},
    "pyramid-3": {"shape": "pyramid", "faces": "three"},
    "pyramid-4": {"shape": "pyramid", "faces": "four"},
}
_WORDS = {
    "law": ("hertz", "sneddon", "layer"),
    "base": ("bonded", "frictionless"),
    "property": ("modulus", "unloading", "relaxation", "dynamic"),
    "family": ("prony", "fractional"),
}
#: Options that belong to some properties only.
_OWN: Dict[str, Tuple[str, ...]] = {
    "depth_max": ("modulus",),
    "zero_error": ("modulus", "unloading"),
    "law": ("modulus", "relaxation", "dynamic"),
    "family": ("relaxation",),
    "terms": ("relaxation",),
    "frequency": ("dynamic",),
    "moving_mass": ("dynamic",),
}


class Material(Report):
    """Moduli with all they rest on: a mapping with the content of ``palpate material --json``.

    >>> known = {"thickness": (60.0, 0.5), "poisson": (0.49, 0.01), "contact_error": "free"}
    >>> found = palpate.open("demo").material("flat-punch", radius=(6.00, 0.02), depth_max=0.9, **known)
    >>> found["specimen"]["poisson_basis"], found["not_included"]
    ('assumed', ['machine compliance'])
    >>> found.total95_kpa[0] < found.modulus_kpa < found.total95_kpa[1]
    True
    """

    def __init__(
        self,
        report: Dict[str, Any],
        text: str,
        curve: "Optional[Tuple[np.ndarray, np.ndarray, np.ndarray]]" = None,
        notes: Sequence[str] = (),
    ) -> None:
        self._report = report
        self._text = text
        #: The loading or unloading that was fitted: depths from the contact in mm, forces and those of the law in N; None
        #: where the modulus was read from a session, and for relaxation and dynamic moduli.
        self.depth, self.force, self.law_force = curve or (None, None, None)
        #: Remarks on the data.
        self.notes: List[str] = list(notes)

    @property
    def modulus_kpa(self) -> float:
        """Young's modulus in kPa; relaxation and dynamic moduli have none."""
        return 1e3 * self._young("modulus_mpa")

    @property
    def total95_kpa(self) -> Tuple[float, float]:
        """Its 95 % interval in kPa, in which a lack of fit counts as noise that lasts."""
        low, high = self._young("total95_mpa")
        return 1e3 * low, 1e3 * high

    def _young(self, field: str) -> Any:
        if field not in self._report:
            kind = self._report["property"]
            raise PalpateError(f"the property {kind} has no single Young's modulus; take its numbers from the mapping")
        return self._report[field]

    def to_dict(self) -> Dict[str, Any]:
        """The report as a plain dictionary, as in JSON."""
        return self._report

    def __repr__(self) -> str:
        return self._text


def _number(value: Any, what: str) -> float:
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        return float(value)
    raise PalpateError(f"{what} cannot be {value!r}; give a number, or a pair of a number and its standard uncertainty")


def _quantity(value: Any, what: str) -> Dict[str, float]:
    number, error = value if isinstance(value, (tuple, list)) and len(value) == 2 else (value, 0.0)
    return {"value": _number(number, what), "standard_uncertainty": _number(error, what)}


def _indenter(word: str, radius: Any, half_angle: Any, tip_radius: Any, chamfer: Any) -> Dict[str, Any]:
    if word not in _INDENTERS:
        raise PalpateError(f"{word!r} is not an indenter; the indenters are {', '.join(_INDENTERS)}")
    needed, other = ("radius", "half_angle") if word in ("flat-punch", "sphere") else ("half_angle", "radius")
    sizes = {"radius": radius, "half_angle": half_angle}
    if sizes[other] is not None:
        raise PalpateError(f"a {word} has no {other}; leave it out")
    if sizes[needed] is None:
        raise PalpateError(f"a {word} needs its {needed}; give it, with its standard uncertainty")
    field = {"radius": "radius_mm", "half_angle": "half_angle_degrees"}[needed]
    document = {**_INDENTERS[word], field: _quantity(sizes[needed], needed)}
    is_pointed = needed == "half_angle"
    if chamfer is not None and word != "flat-punch":
        raise PalpateError(f"a {word} has no chamfer; leave it out")
    if tip_radius is not None and not is_pointed:
        raise PalpateError(f"a {word} has no tip_radius; leave it out")
    if chamfer is not None:
        document |= {"shape": "chamfered-punch", "chamfer_mm": _quantity(chamfer, "chamfer")}
    if tip_radius is not None:
        shape = f"rounded-{document['shape']}"
        document |= {"shape": shape, "tip_radius_mm": _quantity(tip_radius, "tip_radius")}
    return document


def _error_source(value: Union[None, str, float], what: str) -> Optional[str]:
    return value if value in (None, "free") else json.dumps(_number(value, what))  # type: ignore[return-value]


def _word(word: str, what: str) -> str:
    if word not in _WORDS[what]:
        raise PalpateError(f"{word!r} is not a {what}; give one of {', '.join(_WORDS[what])}")
    return word


def _check_own(name: str, **given: Any) -> None:
    for option, own in _OWN.items():
        if given[option] is not None and name not in own:
            raise PalpateError(f"{option} belongs to the property {' or '.join(own)}; leave it out")


def material(
    source: "str | os.PathLike[str]",
    indenter: str,
    *,
    property: str = "modulus",
    radius: Optional[Quantity] = None,
    half_angle: Optional[Quantity] = None,
    tip_radius: Optional[Quantity] = None,
    chamfer: Optional[Quantity] = None,
    thickness: Optional[Quantity] = None,
    poisson: Quantity,
    poisson_measured: bool = False,
    base: str = "bonded",
    law: Optional[str] = None,
    depth_max: Optional[float] = None,
    contact_error: Union[None, str, float] = None,
    zero_error: Union[None, str, float] = None,
    family: Optional[str] = None,
    terms: Optional[int] = None,
    frequency: Optional[float] = None,
    moving_mass: Optional[Quantity] = None,
    analysis: Optional[str] = None,
    include_rejected: bool = False,
    compliance: Optional[str] = None,
    save: Optional[str] = None,
    by: Optional[str] = None,
    reason: str = "",
) -> Material:
    """Moduli of a press, of a session's folder or a table, as ``palpate material`` gives them.

    ``property`` is ``"modulus"`` (Young's modulus of the loading), ``"unloading"`` (of the unloading), ``"relaxation"`` (the
    shear relaxation modulus of ramp and hold, with the creep compliance) or ``"dynamic"`` (storage and loss modulus of
    sines). The options are those of the command. Lengths in mm, a half angle in degrees, Poisson's ratio and the moving mass in
    g are a number that is taken as exact, or a pair of a number and its standard uncertainty. Without ``thickness`` it is the
    one that the session measured, and without ``law`` it is that of a layer. ``contact_error`` and ``zero_error`` are
    ``"free"``, or a standard uncertainty in mm and in N. ``family`` (``"prony"`` or ``"fractional"``) and
    ``terms`` belong to a relaxation modulus, ``frequency`` in Hz and ``moving_mass`` to dynamic moduli. ``save`` stores the result with the session under that name.

    >>> palpate.material("demo", "sphere", poisson=0.5)
    Traceback (most recent call last):
        ...
    palpate.PalpateError: a sphere needs its radius; give it, with its standard uncertainty
    """
    _check_own(
        _word(property, "property"),
        depth_max=depth_max,
        zero_error=zero_error,
        law=law,
        family=family,
        terms=terms,
        frequency=frequency,
        moving_mass=moving_mass,
    )
    request = {
        "indenter": json.dumps(_indenter(indenter, radius, half_angle, tip_radius, chamfer)),
        "thickness": None if thickness is None else json.dumps(_quantity(thickness, "thickness")),
        "poisson": json.dumps(_quantity(poisson, "poisson")),
        "poisson_measured": bool(poisson_measured),
        "base": json.dumps(_word(base, "base")),
        "law": json.dumps(_word("layer" if law is None else law, "law")),
        "depth_max": None if depth_max is None else _number(depth_max, "depth_max"),
        "contact_error": _error_source(contact_error, "contact_error"),
        "zero_error": _error_source(zero_error, "zero_error"),
        "property": property,
        "family": None if family is None else _word(family, "family"),
        "terms": None if terms is None else _fit.check_whole(terms, "terms"),
        "frequency": None if frequency is None else _number(frequency, "frequency"),
        "moving_mass": None if moving_mass is None else json.dumps(_quantity(moving_mass, "moving_mass")),
        "analysis": analysis,
        "include_rejected": bool(include_rejected),
        "compliance": None if compliance is None else os.fspath(compliance),
        "save": save,
        "by": by,
        "reason": reason,
    }
    report, text, curve, notes = fit_material(os.fspath(source), request)
    return Material(json.loads(report), text, curve, notes)
