"""Tables that come from elsewhere, as columns of plain values."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Optional, Union

from ._errors import ChainwaveError

Path = Union[str, "os.PathLike[str]"]
"""Where a file lies."""

TableLike = Any
"""A table: a dict of columns, a list of dicts, or any table whose columns stand under their names (polars, pandas, pyarrow,
:class:`chainwave.Table`). ``None`` and NaN are lost values."""

Columns = list[tuple[str, list[Any]]]

_NUMBERS = (int, float, bool, type(None))


def whole(value: Any, least: int, what: str, most: Optional[int] = None) -> int:
    """A whole number of at least so much, and at most so much where that is said; `what` names it in messages."""
    try:
        found = None if isinstance(value, (bool, str, bytes)) or int(value) != value else int(value)
    except (TypeError, ValueError, OverflowError):
        found = None
    if found is None or found < least or (most is not None and found > most):
        range_of = f"of at least {least}" if most is None else f"from {least} to {most}"
        raise ChainwaveError(f"{what}: expected a whole number {range_of}, found {value!r}")
    return found


def number(value: Any, what: str) -> float:
    """A finite number; `what` names it in messages."""
    import math

    try:
        found = math.nan if isinstance(value, (bool, str, bytes)) else float(value)
    except (TypeError, ValueError, OverflowError):
        found = math.nan
    if not math.isfinite(found):
        raise ChainwaveError(f"{what}: expected a number, found {value!r}")
    return found


def threads_of(value: Optional[int]) -> Optional[int]:
    """A number of threads, or nothing."""
    return None if value is None else whole(value, 1, "threads")


def is_path(value: object) -> bool:
    """Whether a value is where a file lies."""
    return isinstance(value, (str, os.PathLike))


def columns_of(table: TableLike, what: str) -> Columns:
    """The columns of a table; `what` names it in messages."""
    if isinstance(table, Mapping):
        return [(str(name), _plain(values)) for name, values in table.items()]
    names = getattr(table, "column_names", None) or getattr(table, "columns", None)
    if names is not None and hasattr(table, "__getitem__"):
        return [(str(name), _plain(table[name])) for name in names]
    if isinstance(table, Sequence) and table and all(isinstance(row, Mapping) for row in table):
        found: dict[str, None] = {}
        for row in table:
            found.update(dict.fromkeys(row))
        return [(name, of_one_kind([_item(row.get(name)) for row in table])) for name in found]
    raise ChainwaveError(
        f"{what}: expected a path, a dict of columns, a list of dicts or a table with named columns, "
        f"found {type(table).__name__}"
    )


def table_argument(table: TableLike, what: str) -> Columns | str:
    """A path as it is, or columns."""
    return os.fspath(table) if is_path(table) else columns_of(table, what)


def _plain(values: Any) -> list[Any]:
    for name in ("to_pylist", "to_list", "tolist"):
        convert = getattr(values, name, None)
        if convert is not None:
            return of_one_kind(list(convert()))
    if isinstance(values, Iterable) and not isinstance(values, (str, bytes)):
        return of_one_kind([_item(value) for value in values])
    raise ChainwaveError(f"a column: expected a list or an array, found {type(values).__name__}")


def of_one_kind(values: list[Any]) -> list[Any]:
    """Numbers as they are, or texts: what is lost is None, and what is neither stands as its text for whoever asks for it."""
    if all(type(value) in _NUMBERS for value in values):
        return values
    known = [None if _is_lost(value) else value for value in values]
    if all(isinstance(value, (int, float, type(None))) for value in known):
        return known
    return [None if value is None else str(value) for value in known]


def _is_lost(value: Any) -> bool:
    try:
        return value is None or bool(value != value)
    except (TypeError, ValueError):
        # pandas.NA is neither equal to itself nor not.
        return True


def _item(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value
