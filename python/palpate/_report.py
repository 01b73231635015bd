"""What a report in JSON is to Python."""
from __future__ import annotations

from collections.abc import Mapping as _Mapping
from typing import Any, Dict, Iterator


class Report(_Mapping):  # type: ignore[type-arg]
    """A mapping with the content of a command's ``--json``."""

    _report: Dict[str, Any]

    def __getitem__(self, key: str) -> Any:
        return self._report[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._report)

    def __len__(self) -> int:
        return len(self._report)
