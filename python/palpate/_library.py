"""The library: a folder of sessions that can be searched."""
from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, List, Optional

from . import _frames, _native
from ._session import Session


class Library:
    """A folder of sessions; :func:`palpate.library` makes one."""

    def __init__(self, folder: "None | str | os.PathLike[str]" = None) -> None:
        #: The folder.
        self.folder = Path(_native.default_library() if folder is None else folder)

    def __repr__(self) -> str:
        return f"Library {self.folder}"

    def find(self, query: str = "", frame: Optional[str] = None, **options: "_frames.Option") -> Any:
        """Sessions as a data frame, the latest first, with the fields of ``palpate find --json``.

        ``query`` is a line as in the window's library: words, each the beginning of a word of the session; words of one
        field, such as ``specimen:pig``, ``operator:ada`` or ``tag:pilot``; and conditions on values of the protocol, of
        the session's details or of stored fits, such as ``depth>=20mm``, ``specimen.thickness_mm<12`` or
        ``fit.tau_eps>1.5``. Options are those of ``palpate find``: ``specimen``,
        ``operator``, ``protocol``, ``rig``, ``cell``, ``since``, ``until``, ``tag``, ``verdict``, ``review``, ``sort``,
        ``reverse``, and ``limit`` and ``page``, without which all sessions are listed. ``frame`` is as in
        :meth:`Session.samples`.

        >>> found = palpate.library(".").find("depth>=4mm", protocol="ramp-hold")
        >>> found["folder"].to_list()
        ['demo']
        """
        kind = _frames.chosen(frame)
        is_paged = bool({"limit", "page"} & set(options))
        text, remarks = _native.find(os.fspath(self.folder), query, _frames.arguments(options), is_paged)
        _frames.remark(remarks)
        columns: List[str] = list(json.loads(_native.entry_fields()))
        return _frames.of_records(json.loads(text), columns, kind)

    def open(self, folder: str, analysis: Optional[str] = None) -> Session:
        """Opens a session by its folder below the library, as :meth:`find` lists it."""
        return Session(self.folder / folder, analysis)


def library(folder: "None | str | os.PathLike[str]" = None) -> Library:
    """The library in a folder; without one that of the command line, ``PALPATE_HOME`` or ``~/palpate``.

    >>> len(palpate.library(".").find("no-such-word"))
    0
    """
    return Library(folder)
