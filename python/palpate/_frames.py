"""Data frames of whichever library is installed, and options in the words of the command line."""
from __future__ import annotations

import importlib.util
import warnings
from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Union

from ._native import NativeTable, PalpateError

#: Libraries that make a frame, the preferred one first, each with the module that it takes.
_KINDS = {"polars": "polars", "pandas": "pandas", "arrow": "pyarrow"}


class PalpateWarning(UserWarning):
    """A remark of palpate that belongs to no object, such as a condition that no session can meet."""


def remark(sentences: Iterable[str], level: int = 3) -> None:
    """Warns with each sentence, at the line of palpate's caller."""
    for sentence in sentences:
        warnings.warn(sentence, PalpateWarning, stacklevel=level)


def chosen(kind: Optional[str]) -> str:
    """The kind of frame that is asked for, or the first that is installed."""
    if kind is None:
        for known, module in _KINDS.items():
            if importlib.util.find_spec(module) is not None:
                return known
        raise PalpateError(
            "no library for data frames is installed; install one with pip install 'palpate[polars]', "
            "or ask for numpy arrays with samples('numpy')"
        )
    if kind == "numpy":
        return kind
    if kind not in _KINDS:
        raise PalpateError(f"'{kind}' is not a kind of data frame; give polars, pandas, arrow or numpy")
    if importlib.util.find_spec(_KINDS[kind]) is None:
        raise PalpateError(f"{_KINDS[kind]} is not installed; install it with pip install 'palpate[{kind}]'")
    return kind


def of_table(table: NativeTable, kind: str) -> Any:
    """A frame over the cells of a table, which are not copied where the library can read them as they are."""
    if kind == "polars":
        import polars

        return polars.DataFrame(table)
    if kind == "numpy":
        numbers = {name: table.numbers(name) for name in table.names()}
        return {name: values for name, values in numbers.items() if values is not None}
    import pyarrow

    arrow = pyarrow.table(table)
    if kind == "arrow":
        return arrow
    frame = arrow.to_pandas()
    frame.attrs.update({key: text for key, text in table.metadata()})
    return frame


def of_records(records: List[Dict[str, Any]], columns: Sequence[str], kind: str) -> Any:
    """A frame of objects that all have these fields; with none of them it has the columns."""
    if kind == "polars":
        import polars

        if not records:
            return polars.DataFrame(schema=list(columns))
        return polars.DataFrame(records, infer_schema_length=None)
    if kind == "pandas":
        import pandas

        return pandas.DataFrame.from_records(records, columns=list(columns))
    if kind == "arrow":
        import pyarrow

        if not records:
            return pyarrow.table({name: pyarrow.nulls(0) for name in columns})
        return pyarrow.Table.from_pylist(records)
    raise PalpateError("sessions have texts and lists, which numpy arrays do not hold; give polars, pandas or arrow")


Option = Union[None, bool, str, int, float, Sequence[Any], Mapping[str, Any]]


def arguments(options: Mapping[str, Option]) -> List[str]:
    """Options of a command: ``time_scale="max"`` is ``--time-scale=max``, True is the option alone, and a list or a
    mapping repeats it. What is None or False is left out."""
    words: List[str] = []
    for name, value in options.items():
        flag = "--" + name.rstrip("_").replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(flag)
        elif isinstance(value, Mapping):
            words.extend(f"{flag}={key}={one}" for key, one in value.items())
        elif isinstance(value, (list, tuple, set, frozenset)):
            words.extend(f"{flag}={one}" for one in value)
        else:
            words.append(f"{flag}={value}")
    return words
