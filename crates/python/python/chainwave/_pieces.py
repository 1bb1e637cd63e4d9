"""The pieces of an experiment, for tracks of any origin: merge, measure, fit."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Optional, Union

from . import _chainwave, _html
from ._columns import Columns, Path, TableLike, columns_of, is_path, number, of_one_kind, table_argument, threads_of, whole
from ._errors import ChainwaveError
from ._estimate import Estimate, estimates_of
from ._figure import Figure
from ._models import text_of
from ._recording import warn
from ._strain import StrainMap
from ._table import Table
from ._toml import toml_of
from ._wave import Wave

if TYPE_CHECKING:
    from ._chainwave import ArrowTable


class MergedMotion(Table):
    """The motion of trials together: `t_s`, `body`, `x_m`, `sigma_m`, `n_trials`, `within_trial_m`, `between_trials_m`.

    It holds what its errors have in common, which a table cannot say: give it to :func:`measure` as it is.
    """

    def __init__(self, inner: ArrowTable, merged: _chainwave.MergedMotion, alignments: list[dict[str, Any]]) -> None:
        super().__init__(inner)
        self._merged = merged
        #: Where each trial stands: `recording`, `view`, `trial`, `trigger_offset_s`, `drive_deviation`, their sigmas, `scatter_ratio`.
        self.alignments = alignments


class Measurement(Wave):
    """What is measured of a motion."""


class Fit:
    """Dampings of a chain, fitted to tracks."""

    def __init__(self, numbers: dict[str, Estimate], details: dict[str, Any], warnings: list[str]) -> None:
        self._numbers = numbers
        #: `correlation`, `reduced_chi_squared`, `n_residuals`, `n_simulations`, `is_believed`.
        self.details = details
        #: What the reader should know.
        self.warnings = warnings

    @property
    def c_d_kg_per_s(self) -> Estimate:
        """Damping of each body to ground."""
        return self._numbers["c_d_kg_per_s"]

    @property
    def c_s_kg_per_s(self) -> Estimate:
        """Damping of the striker's contact."""
        return self._numbers["c_s_kg_per_s"]

    @property
    def striker_velocity_m_per_s(self) -> Estimate:
        """Mean striker velocity of the trials."""
        return self._numbers["striker_velocity_m_per_s"]

    @property
    def impact_time_s(self) -> Estimate:
        """Mean stamp of the impact, after the trigger."""
        return self._numbers["impact_time_s"]

    def __repr__(self) -> str:
        told = ", ".join(f"{name} = {estimate}" for name, estimate in self._numbers.items())
        return f"<chainwave.Fit: {told}>"

    def _repr_html_(self) -> str:
        return _html.table_of(self._numbers) + _html.list_of(self.warnings)


def merge(
    tracks: Union[TableLike, Sequence[TableLike]],
    *,
    rest_until_s: float,
    m_per_px: Optional[float] = None,
    n_bodies: Optional[int] = None,
    drive_scatter: Optional[float] = None,
    trigger_sigma_s: Optional[float] = None,
    view_trigger_sigma_s: Optional[float] = None,
) -> MergedMotion:
    """Merge trials (and views) into one motion, whichever program tracked them.

    Each trial's trigger and drive are found from what its bodies do; a trial that contradicts the others is left out.

    Parameters
    ----------
    tracks : path, dict of columns, list of dicts, or table; or a list of tables
        A row for each trial, body and instant: `recording` (or `trial`), `body` (from 1, the struck one), `t_s` after the trigger,
        `x_m` along the chain from any origin, `sigma_m`; `view` and `trial` where there are several views. A lost position is null
        or has no row. Of a list, each table without `recording` is a trial.
    rest_until_s : float
        Samples before this time show the chain at rest.
    m_per_px : float, optional
        Scale of tables in pixels, such as :func:`chainwave.track` gives: `x_px` and `sigma_x_px` are then taken for `x_m` and
        `sigma_m` (negative where the chain runs to the left), and `name` for `body`.
    n_bodies : int, optional
        Bodies in the chain; the largest number in the tracks when left out.
    drive_scatter : float, optional
        Relative standard deviation of the drives, where it is known.
    trigger_sigma_s, view_trigger_sigma_s : float, optional
        Standard deviation of the triggers from trial to trial, and from view to view, where they are known.

    Returns
    -------
    MergedMotion
        Displacements from rest in metres, with their standard uncertainties.
    """
    import json

    inner, table, alignments, notes = _chainwave.merge(
        _trials(tracks, m_per_px),
        n_bodies=None if n_bodies is None else whole(n_bodies, 1, "n_bodies"),
        rest_until_s=rest_until_s,
        drive_scatter=drive_scatter,
        trigger_sigma_s=trigger_sigma_s,
        view_trigger_sigma_s=view_trigger_sigma_s,
    )
    for note in notes:
        warn(note)
    return MergedMotion(table, inner, json.loads(alignments))


def _trials(tracks: Any, m_per_px: Optional[float]) -> Union[str, Columns]:
    if is_path(tracks) and m_per_px is None:
        return table_argument(tracks, "tracks")
    several = isinstance(tracks, (list, tuple)) and not all(isinstance(row, Mapping) and _is_row(row) for row in tracks)
    if not several:
        return _in_metres(_columns_in(tracks), m_per_px)
    joined: dict[str, list[Any]] = {}
    for number, one in enumerate(tracks, start=1):
        columns = dict(_in_metres(_columns_in(one), m_per_px))
        n_rows = len(columns.get("t_s", []))
        columns.setdefault("recording", [f"trial {number}"] * n_rows)
        if joined and set(joined) != set(columns):
            raise ChainwaveError(f"tracks: table {number}: expected the columns {', '.join(joined)}, found {', '.join(columns)}")
        for name, values in columns.items():
            joined.setdefault(name, []).extend(values)
    return [(name, of_one_kind(values)) for name, values in joined.items()]


def _columns_in(table: Any) -> Columns:
    return _chainwave.columns_of_csv(os.fspath(table)) if is_path(table) else columns_of(table, "tracks")


def _is_row(row: Mapping[Any, Any]) -> bool:
    return all(isinstance(value, (str, int, float, type(None))) or hasattr(value, "item") and not hasattr(value, "__len__") for value in row.values())


def _in_metres(columns: Columns, m_per_px: Optional[float]) -> Columns:
    if m_per_px is None:
        return columns
    found = dict(columns)
    missing = [name for name in ("x_px", "sigma_x_px", "name", "t_s") if name not in found]
    if missing:
        raise ChainwaveError(f"tracks: expected columns {', '.join(missing)} beside m_per_px, found {', '.join(found)}")

    def scaled(name: str, factor: float) -> list[Optional[float]]:
        return [None if value in (None, "") or value != value else factor * _number(name, value) for value in found[name]]

    kept = [(name, found[name]) for name in ("recording", "view", "trial", "t_s") if name in found]
    return [
        *kept,
        ("body", found.get("body") or [_body(name) for name in found["name"]]),
        ("x_m", scaled("x_px", m_per_px)),
        ("sigma_m", scaled("sigma_x_px", abs(m_per_px))),
    ]


def _number(name: str, value: Any) -> float:
    try:
        return float(value)
    except ValueError as wrong:
        raise ChainwaveError(f"tracks: {name} {value!r}: expected a number") from wrong


def _body(name: Any) -> int:
    try:
        return int(str(name))
    except ValueError as wrong:
        raise ChainwaveError(f"tracks: name {name!r}: expected the number of a body (hint: a column body says it)") from wrong


def measure(
    motion: TableLike,
    *,
    pitch_m: Union[float, Sequence[float]],
    first_gap: int = 1,
    last_gap: Optional[int] = None,
    edge_fraction: float = 0.1,
    end_reflects: bool = False,
    contact: Optional[Mapping[str, Any]] = None,
    n_replicas: int = 200,
    seed: int = 1,
    threads: Optional[int] = None,
) -> Measurement:
    """Measure the wave of a motion: strain, front, group velocity, half width, spectrum, energies.

    Parameters
    ----------
    motion : MergedMotion, path, dict of columns, or table
        What :func:`merge` or :func:`chainwave.simulate` gave, or `t_s`, `body` (from 1; 0, the striker, is left out), `x_m` and,
        unless the motion is exact, `sigma_m`; samples are equally spaced.
    pitch_m : float or sequence
        Distance between neighbours at rest, or one for each gap.
    first_gap, last_gap : int, optional
        Gaps over which the group velocity is taken; without `last_gap`, as far as the leading pulse remains one pulse.
    edge_fraction : float, optional
        The leading edge is where a gap first exceeds this fraction of its peak.
    end_reflects : bool, optional
        Leave out what a reflection from the last body has reached.
    contact : dict, optional
        The table `contact` of a scene, for energies.
    n_replicas, seed : int, optional
        Replicas of the motion behind each sigma, and their seed.
    threads : int, optional
        All cores when left out; the bits are the same for any number.

    Returns
    -------
    Measurement
        Numbers with their uncertainties in SI units, and the tables that ``chainwave run`` writes.

    Examples
    --------
    A pulse of compression that travels at 200 m/s without changing its shape:

    >>> import chainwave as cw
    >>> import numpy as np
    >>> body, t_s = np.meshgrid(np.arange(1, 21), np.arange(400) * 1e-5, indexing="ij")
    >>> x_m = 1e-3 * (1.0 + np.tanh((t_s - 0.03 * (body - 1) / 200.0 - 1e-3) / 2e-4))
    >>> motion = {"t_s": t_s.ravel(), "body": body.ravel(), "x_m": x_m.ravel()}
    >>> measured = cw.measure(motion, pitch_m=0.03, first_gap=2, last_gap=12)
    >>> round(measured.group_velocity_m_per_s.value)
    200
    """
    gaps: Union[float, list[float]]
    if isinstance(pitch_m, Iterable) and not isinstance(pitch_m, (str, bytes)):
        gaps = [number(gap_m, "pitch_m") for gap_m in pitch_m]
    else:
        gaps = number(pitch_m, "pitch_m")
    found, tables, figures = _chainwave.measure_motion(
        motion._merged if isinstance(motion, MergedMotion) else table_argument(motion, "motion"),
        {
            "pitch_m": gaps,
            "first_gap": whole(first_gap, 1, "first_gap"),
            "last_gap": None if last_gap is None else whole(last_gap, 1, "last_gap"),
            "edge_fraction": number(edge_fraction, "edge_fraction"),
            "end_reflects": end_reflects,
            "n_replicas": whole(n_replicas, 20, "n_replicas"),
            "seed": whole(seed, 0, "seed", 2**64 - 1),
            "contact": None if contact is None else toml_of({"contact": contact}),
            "threads": threads_of(threads),
        },
    )
    return Measurement(estimates_of(found), dict(tables), {name: Figure(figure) for name, figure in figures})


def strain_map(motion: TableLike, *, pitch_m: Union[float, Sequence[float]]) -> StrainMap:
    """Strain of every gap over time: `t_s`, `gap`, `strain`, `sigma`; compression is negative.

    Parameters
    ----------
    motion, pitch_m
        As for :func:`measure`.

    Returns
    -------
    StrainMap
        A row for each gap and time; :meth:`StrainMap.grid` has the map as an array of shape ``(n_gaps, n_times)``.
    """
    # The sigma of a strain follows from those of the displacements, without replicas, of which 20 are the fewest.
    return measure(motion, pitch_m=pitch_m, n_replicas=20).strain


def fit(
    motion: MergedMotion,
    scene: Union[Path, Mapping[str, Any]],
    *,
    striker_velocity_sigma_m_per_s: float,
    threads: Optional[int] = None,
) -> Fit:
    """Fit the dampings of a chain to the trials of a merged motion.

    Parameters
    ----------
    motion : MergedMotion
        What :func:`merge` gave.
    scene : path or dict
        The chain as for :func:`chainwave.simulate`, struck by a striker; the dampings are where the search starts. `duration_s` and
        `output_interval_s` may be left out of a dict.
    striker_velocity_sigma_m_per_s : float
        Standard deviation of the striker's velocity from trial to trial.
    threads : int, optional
        All cores when left out; the bits are the same for any number.

    Returns
    -------
    Fit
        `c_d_kg_per_s` and `c_s_kg_per_s`, the striker's velocity in m/s and the impact's time in seconds, each with its uncertainty.
    """
    import json

    if isinstance(scene, Mapping):
        scene = {"duration_s": 1.0, "output_interval_s": 1.0, **scene}
    path, text = text_of(scene, "scene")
    numbers, details, warnings = _chainwave.fit(
        motion._merged, path, text, striker_velocity_sigma_m_per_s=striker_velocity_sigma_m_per_s, n_threads=threads_of(threads)
    )
    for warning in warnings:
        warn(warning)
    return Fit(estimates_of(numbers), json.loads(details), warnings)
