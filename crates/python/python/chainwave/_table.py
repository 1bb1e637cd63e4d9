"""Tables of results."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Optional

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ._chainwave import ArrowTable

_ROWS_SHOWN = 8


class Table:
    """A table of results: named columns of one length, the unit last in a name.

    Polars, pandas, pyarrow, DuckDB and whatever else knows the Arrow PyCapsule interface take it as it is, without a copy
    of its values: ``polars.DataFrame(table)``, ``pyarrow.table(table)``. There, a lost value is null. A single column is a NumPy
    array, ``table["x_px"]``; NumPy knows no null, so there, and only there, a lost number is NaN.

    Notes
    -----
    Numbers are ``float64``, counts ``uint32`` (``float64`` in NumPy where one is lost), texts ``object``.
    """

    def __init__(self, inner: ArrowTable) -> None:
        self._inner = inner

    @property
    def columns(self) -> list[str]:
        """Names of the columns, in their order."""
        return self._inner.columns

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self._inner), len(self._inner.columns)

    def __len__(self) -> int:
        """Number of rows."""
        return len(self._inner)

    def __iter__(self) -> Iterator[str]:
        """The names of the columns."""
        return iter(self.columns)

    def __contains__(self, name: object) -> bool:
        """Whether there is a column of this name."""
        return name in self.columns

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A column as a NumPy array of shape ``(len(table),)``; a lost number is NaN."""
        import numpy as np

        kind = self._inner.kind(name)
        if kind == "text":
            texts: NDArray[Any] = np.array(self._inner.texts(name), dtype=object)
            return texts
        values, mask = self._inner.raw(name)
        numbers: NDArray[Any] = np.frombuffer(values, dtype=kind)
        if mask is None:
            return numbers
        lost = np.frombuffer(mask, dtype=bool)
        return np.where(lost, np.nan, numbers.astype(np.float64))

    def to_dict(self) -> dict[str, NDArray[Any]]:
        """All columns as NumPy arrays, by their names; a lost number is NaN."""
        return {name: self[name] for name in self.columns}

    def __arrow_c_schema__(self) -> object:
        """The schema, by the Arrow PyCapsule interface."""
        return self._inner.__arrow_c_schema__()

    def __arrow_c_stream__(self, requested_schema: Optional[object] = None) -> object:
        """The table, by the Arrow PyCapsule interface."""
        return self._inner.__arrow_c_stream__(requested_schema)

    def _cells(self, n_rows: int) -> list[list[str]]:
        def text(value: Any) -> str:
            if isinstance(value, str):
                return value
            return "" if value != value else f"{value:.6g}"

        shown = [self[name][:n_rows] for name in self.columns]
        return [[text(column[row]) for column in shown] for row in range(min(n_rows, len(self)))]

    def __repr__(self) -> str:
        return f"<chainwave.{type(self).__name__}: {len(self)} rows of {', '.join(self.columns)}>"

    def _repr_html_(self) -> str:
        import html

        head = "".join(f"<th>{html.escape(name)}</th>" for name in self.columns)
        rows = "".join(
            "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in self._cells(_ROWS_SHOWN)
        )
        more = f"<p>{len(self)} rows, the first {_ROWS_SHOWN} are shown</p>" if len(self) > _ROWS_SHOWN else ""
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{more}"
