"""Forward models and contact laws."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Union

from . import _chainwave, _html
from ._columns import Path, TableLike, table_argument
from ._estimate import Estimate
from ._table import Table
from ._toml import toml_of

if TYPE_CHECKING:
    from ._chainwave import ArrowTable


class Motion(Table):
    """A computed motion, time by time: `t_s`, `body` (0 is the striker), `x_m`, `v_m_per_s`."""

    def __init__(self, inner: ArrowTable, summary: dict[str, Any]) -> None:
        super().__init__(inner)
        #: How it was computed: `energy_drift` (relative), `psi_max_j` (per gap), `steps`, `dt_s`, `method`, `tension_events`, `wall_s`.
        self.summary = summary


def simulate(scene: Union[Path, Mapping[str, Any]]) -> Motion:
    """Compute the motion of a chain, with the same bits as ``chainwave simulate``.

    Parameters
    ----------
    scene : path or dict
        A scene of the chain model, as a TOML file or as a dict of the same tables. Files that it names are looked for beside it,
        those of a dict in the current folder.

    Returns
    -------
    Motion
        Displacements in metres and velocities in metres per second.

    Examples
    --------
    >>> import chainwave as cw
    >>> motion = cw.simulate({
    ...     "model": "chain", "n_bodies": 4, "duration_s": 1e-3, "output_interval_s": 1e-4,
    ...     "body": {"mass_kg": 0.455e-3, "pitch_m": 0.03, "damping_kg_per_s": 0.003},
    ...     "contact": {"law": "power", "a": 60.1, "delta_0_m": 2.27e-3, "p": 0.114},
    ...     "drive": {"kind": "striker", "mass_kg": 4.3e-3, "velocity_m_per_s": 2.73, "damping_kg_per_s": 0.2},
    ... })
    >>> motion.columns
    ['t_s', 'body', 'x_m', 'v_m_per_s']
    """
    import json

    path, text = text_of(scene, "scene")
    inner, summary = _chainwave.simulate(path, text)
    return Motion(inner, json.loads(summary))


def text_of(configuration: Union[Path, Mapping[str, Any]], name: str) -> tuple[str, str]:
    """Where a configuration stands, and its text; a dict goes under a name."""
    if isinstance(configuration, Mapping):
        return f"{name} (a dict)", toml_of(configuration)
    path = os.fspath(configuration)
    return path, _chainwave.read_text(path)


class ContactLaw:
    """A contact law, F = a (overlap + delta_0)^p - f_0 with f_0 = a delta_0^p, in newtons and metres."""

    def __init__(self, parameters: dict[str, Estimate], details: dict[str, Any]) -> None:
        self._parameters = parameters
        #: What else is known of the fit: `factor_95`, `cannot_tell_apart`, `correlation`, `residual`, `p_interval`.
        self.details = details

    @property
    def a(self) -> Estimate:
        """Prefactor, in N/m^p."""
        return self._parameters["a"]

    @property
    def delta_0_m(self) -> Estimate:
        """Offset of the overlap, in metres."""
        return self._parameters["delta_0_m"]

    @property
    def p(self) -> Estimate:
        """Exponent."""
        return self._parameters["p"]

    @property
    def f_0_n(self) -> Estimate:
        """Force that the law takes off, in newtons."""
        return self._parameters["f_0_n"]

    @property
    def k_0_n_per_m(self) -> Estimate:
        """Stiffness at zero overlap, in newtons per metre."""
        return self._parameters["k_0_n_per_m"]

    def as_contact(self) -> dict[str, Any]:
        """The law as the table `contact` of a scene or an experiment."""
        return {"law": "power", **{name: float(self._parameters[name]) for name in ("a", "delta_0_m", "p")}}

    def force_n(self, overlap_m: Any) -> Any:
        """Force in newtons at an overlap in metres; a number or an array."""
        a, delta_0_m, p, f_0_n = (float(self._parameters[name]) for name in ("a", "delta_0_m", "p", "f_0_n"))
        return a * (overlap_m + delta_0_m) ** p - f_0_n

    def __repr__(self) -> str:
        told = ", ".join(f"{name} = {estimate}" for name, estimate in self._parameters.items())
        return f"<chainwave.ContactLaw: {told}>"

    def _repr_html_(self) -> str:
        return _html.table_of(self._parameters) + _html.list_of(self.details["cannot_tell_apart"])


def fit_contact(curve: TableLike, *, zero: str = "auto") -> ContactLaw:
    """Fit the contact law to a compression curve, with the same bits as ``chainwave contact``.

    Parameters
    ----------
    curve : path, dict of columns, list of dicts, or table
        `overlap_m` and `force_n`, both positive in compression, in the order of the measurement.
    zero : {"auto", "stated", "load-cell", "contact"}, optional
        Where overlap and force are zero.

    Returns
    -------
    ContactLaw
        `a`, `delta_0_m`, `p`, `f_0_n`, `k_0_n_per_m`, each with `.value`, `.sigma` and `.interval95` (by Student's factor).

    Examples
    --------
    >>> import chainwave as cw
    >>> import numpy as np
    >>> overlap_m = np.linspace(0.0, 5e-3, 60)
    >>> exact_n = 60.1 * ((overlap_m + 2.27e-3) ** 0.114 - 2.27e-3 ** 0.114)
    >>> noise_n = 0.01 * np.sin(np.arange(60) ** 2)
    >>> law = cw.fit_contact({"overlap_m": overlap_m, "force_n": exact_n + noise_n})
    >>> low, high = law.k_0_n_per_m.interval95
    >>> bool(low < 60.1 * 0.114 * 2.27e-3 ** (0.114 - 1) < high)
    True
    """
    import json

    parameters, details = _chainwave.fit_contact(table_argument(curve, "curve"), zero)
    return ContactLaw({name: Estimate(*told) for name, told in parameters}, json.loads(details))
