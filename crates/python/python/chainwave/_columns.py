"""Tables that come from elsewhere, as columns of plain values."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Union

from ._errors import ChainwaveError

Path = Union[str, "os.PathLike[str]"]
"""Where a file lies."""

TableLike = Any
"""A table: a dict of columns, a list of dicts, or any table whose columns stand under their names (polars, pandas, pyarrow,
:class:`chainwave.Table`). ``None`` and NaN are lost values."""

Columns = list[tuple[str, list[Any]]]


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
        return [(name, [_item(row.get(name)) for row in table]) for name in found]
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
            return list(convert())
    if isinstance(values, Iterable) and not isinstance(values, (str, bytes)):
        return [_item(value) for value in values]
    raise ChainwaveError(f"a column: expected a list or an array, found {type(values).__name__}")


def _item(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value
