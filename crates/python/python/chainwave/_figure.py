"""Figures as SVG, and their numbers for matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from ._columns import Path
from ._table import Table

if TYPE_CHECKING:
    from ._chainwave import Drawing


class Shown(NamedTuple):
    """The numbers of a curve, of a set of markers, or of a map."""

    #: Title of the panel; empty where a figure has one panel without a title.
    panel: str
    #: Name in the legend.
    series: str
    #: Quantity and unit along the abscissa.
    x: str
    #: Quantity and unit along the ordinate.
    y: str
    #: Quantity and unit of the colours of a map; empty for curves and markers.
    colour: str
    #: `x`, `sigma_x`, `y`, `sigma_y` and `colour` in the units of the axes; nothing measured is null.
    table: Table


class Figure:
    """A figure as ``chainwave run`` draws it, made when it is asked for; notebooks show it."""

    def __init__(self, inner: Drawing) -> None:
        self._inner = inner

    @property
    def svg(self) -> str:
        """The figure as an SVG document."""
        return self._inner.svg()

    @property
    def data(self) -> list[Shown]:
        """The numbers that it shows, in the units of its axes, to be drawn by other means."""
        return [Shown(panel, series, x, y, colour, Table(table)) for panel, series, x, y, colour, table in self._inner.data()]

    def save(self, path: Path) -> None:
        """Write the figure as an SVG file."""
        import pathlib

        pathlib.Path(path).write_text(self.svg, encoding="utf-8")

    def _repr_svg_(self) -> str:
        return self.svg
