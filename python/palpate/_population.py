"""From the sessions of a study to the population of its specimens."""
from __future__ import annotations

import json
import os
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

from ._native import find_agreement, find_population
from ._report import Report

_Path = Union[str, "os.PathLike[str]"]


class _Found(Report):
    def __init__(self, answer: Tuple[str, str]) -> None:
        self._report = json.loads(answer[0])
        self._text = answer[1]

    def to_dict(self) -> Dict[str, Any]:
        """The report as a plain dictionary, as in JSON."""
        return self._report

    def __repr__(self) -> str:
        return self._text


class Population(_Found):
    """A population: a mapping with the content of ``palpate population --json``."""


class Agreement(_Found):
    """Bias and limits of agreement: a mapping with the content of ``palpate agreement --json``."""


def _sources(sources: Union[_Path, Sequence[_Path]]) -> List[_Path]:
    return [sources] if isinstance(sources, (str, os.PathLike)) else list(sources)


def _jobs(jobs: Optional[int]) -> int:
    return jobs or os.cpu_count() or 1


def population(
    sources: Union[_Path, Sequence[_Path]],
    *,
    family: Optional[str] = None,
    parameters: Sequence[str] = (),
    levels: Sequence[str] = (),
    effects: Sequence[str] = (),
    two_stage: bool = False,
    stored: bool = False,
    influence: bool = False,
    wanted: Optional[float] = None,
    compliance: Optional[str] = None,
    out: Optional[_Path] = None,
    jobs: Optional[int] = None,
) -> Population:
    """The population of sessions, folders of sessions, or one lake, as ``palpate population`` finds it.

    ``levels`` are those of ``--by``, ``effects`` those of ``--effect``. ``two_stage`` takes the best values of each session instead of its
    curve, ``stored`` those that the fits of a lake stored. ``influence`` leaves each group out in turn, ``wanted`` is
    the percent that no end of an interval is to be off by, for which studies of other sizes are drawn. ``out`` is a new folder for
    tables, figures and a paragraph.
    """
    options = {
        "family": family,
        "parameters": list(parameters),
        "levels": list(levels),
        "effects": list(effects),
        "two_stage": two_stage,
        "stored": stored,
        "influence": influence,
        "wanted": wanted,
        "compliance": compliance,
        "out": out,
        "jobs": _jobs(jobs),
    }
    return Population(find_population(_sources(sources), options))


def agreement(
    sources: Union[_Path, Sequence[_Path]],
    between: str,
    *,
    family: Optional[str] = None,
    parameters: Sequence[str] = (),
    compliance: Optional[str] = None,
    jobs: Optional[int] = None,
) -> Agreement:
    """How far two operators, rigs, sites or storages agree in the same places, as ``palpate agreement`` finds it.

    ``between`` is the entry that has two values, such as ``"operator"``.

    >>> palpate.agreement("demo", "weather")
    Traceback (most recent call last):
        ...
    palpate.PalpateError: two of 'weather' cannot be compared; choose from operator, rig, specimen.site, specimen.storage
    """
    options = {
        "between": between,
        "family": family,
        "parameters": list(parameters),
        "compliance": compliance,
        "jobs": _jobs(jobs),
    }
    return Agreement(find_agreement(_sources(sources), options))
