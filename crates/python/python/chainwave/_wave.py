"""What every measured wave has, be it of a whole experiment or of one motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import _html
from ._estimate import Estimate
from ._figure import Figure
from ._strain import StrainMap
from ._table import Table

if TYPE_CHECKING:
    from ._chainwave import ArrowTable


class Wave:
    """Numbers, tables and figures of a wave that was measured. The tables have the columns of those that ``chainwave run`` writes."""

    def __init__(
        self, numbers: dict[str, Estimate], tables: dict[str, ArrowTable], figures: dict[str, Figure]
    ) -> None:
        self._numbers = numbers
        #: Figures by their names, `displacements` and `strain-map` among them.
        self.figures = figures
        self._tables = {name: Table(table) for name, table in tables.items() if name != "strain"}
        self._strain = StrainMap(tables["strain"])

    @property
    def group_velocity_m_per_s(self) -> Estimate:
        """Slope of peak position against peak time."""
        return self._numbers["group_velocity_m_per_s"]

    @property
    def local_resonance_hz(self) -> Estimate:
        """Dominant frequency behind the leading pulse."""
        return self._numbers["local_resonance_hz"]

    @property
    def strain(self) -> StrainMap:
        """`t_s`, `gap`, `strain`, `sigma`; :meth:`StrainMap.plot` draws it."""
        return self._strain

    @property
    def front(self) -> Table:
        """`gap`, `t_peak_s`, `t_peak_sigma_s`, `t_edge_s`, ..., `peak_strain`, `peak_strain_sigma`, ..., `status`."""
        return self._tables["front"]

    @property
    def hwhm(self) -> Table:
        """`t_s`, `hwhm_m`, `sigma_m`."""
        return self._tables["hwhm"]

    @property
    def energy(self) -> Table:
        """`gap`, `psi_max_j`, `sigma_j`; empty without a contact law."""
        return self._tables["energy"]

    @property
    def spectrum(self) -> Table:
        """`gap`, `frequency_hz`, `amplitude`."""
        return self._tables["spectrum"]

    def __repr__(self) -> str:
        told = ", ".join(f"{name} = {estimate}" for name, estimate in self._numbers.items())
        return f"<chainwave.{type(self).__name__}: {told}>"

    def _repr_html_(self) -> str:
        return _html.table_of(self._numbers) + self._html_notes() + self.figures["strain-map"].svg

    def _html_notes(self) -> str:
        """What stands between the numbers and the map."""
        return ""
