"""Points followed through recordings, and fields between pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, NamedTuple, Optional

from . import _chainwave
from ._columns import Path, TableLike, is_path, table_argument, threads_of, whole
from ._errors import ChainwaveError
from ._recording import Recording, as_recording, warn
from ._table import Table

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._chainwave import ArrowTable

Progress = Callable[[str, int, int], object]
"""Called with the stage, the steps that are done and those that are planned; what it raises ends the work."""


class Subset(NamedTuple):
    """A subset as it was placed in the reference frame."""

    recording: str
    name: str
    half_width_px: int
    half_height_px: int
    #: Why this size, where it was left open.
    reason: Optional[str]


class Tracks(Table):
    """Tracks: a row for each point and frame.

    Columns: `recording`, `name`, `frame`, `t_s`, `x_px`, `y_px`, `sigma_x_px`, `sigma_y_px`, `theta_rad`,
    `sigma_theta_rad`, `zncc`, `iterations`, `status` (``ok`` or the reason of the loss), `method`.
    """

    def __init__(self, inner: ArrowTable, subsets: list[Subset], methods: list[str]) -> None:
        super().__init__(inner)
        #: The subsets, with the sizes that were given or chosen.
        self.subsets = subsets
        #: The method of each recording, named or chosen.
        self.methods = methods


class Field(Table):
    """A displacement field: a row for each point of a grid, row by row.

    Columns: `x_px`, `y_px`, `u_px`, `v_px`, `sigma_u_px`, `sigma_v_px`, `zncc`, `iterations`, `status`, `shape`, `strain_xx`,
    `strain_yy`, `strain_xy` and their sigmas.
    """

    def __init__(
        self, inner: ArrowTable, n_columns: int, half_size_px: int, step_px: int, method: str, reason: Optional[str]
    ) -> None:
        super().__init__(inner)
        #: Points side by side.
        self.n_columns = n_columns
        #: Columns and rows of a subset on each side of its centre.
        self.half_size_px = half_size_px
        #: Pixels from one point to the next.
        self.step_px = step_px
        #: The method, named or chosen.
        self.method = method
        #: Why this half size, where it was left open.
        self.reason = reason

    def grid(self, name: str) -> NDArray[Any]:
        """A column as an array over the grid, shape ``(n_rows, n_columns)``; a lost number is NaN."""
        return self[name].reshape(-1, self.n_columns)


def _matching(
    method: Optional[str],
    accuracy: Optional[float],
    shape: Optional[str],
    interpolation: Optional[str],
    threads: Optional[int],
) -> dict[str, Any]:
    return {
        "method": method,
        "accuracy": accuracy,
        "shape": shape,
        "interpolation": interpolation,
        "threads": threads_of(threads),
    }


def track(
    recording: Any,
    points: TableLike,
    *,
    method: Optional[str] = None,
    accuracy: Optional[float] = None,
    shape: Optional[str] = None,
    interpolation: Optional[str] = None,
    reference: int = 0,
    rate_hz: Optional[float] = None,
    raw: Optional[str] = None,
    partial: bool = False,
    dark: Optional[Path] = None,
    flat: Optional[Path] = None,
    threads: Optional[int] = None,
    progress: Optional[Progress] = None,
) -> Tracks:
    """Follow points through a recording by digital image correlation, with the same bits as ``chainwave track``.

    Parameters
    ----------
    recording : Recording, path, array_like, or a list of recordings and paths
        What is looked at. An array has shape ``(n_frames, height, width)``.
    points : path, list of dicts, dict of columns, or table
        `name`, `x_px`, `y_px` in the reference frame, and `half_width_px`, `half_height_px`. Where both half sizes are left
        out, the smallest subset is taken that keeps the noise within `accuracy` (0.01 px when left out) and that cannot be taken for
        another.
    method : str, optional
        A rung of the ladder, such as ``"icgn-quintic-affine"``.
    accuracy : float, optional
        In pixels: the cheapest method whose error on these subsets is at most this.
    shape : {"translation", "rigid", "affine", "quadratic", "auto"}, optional
        Shape function; ``"auto"`` is the simplest that the matches cannot reject. Affine when left out.
    interpolation : {"linear", "cubic", "cubic-moms", "quintic", "quintic-moms"}, optional
        Of the deformed picture.
    reference : int, optional
        Number of the reference frame.
    rate_hz, raw, partial, dark, flat
        As for :func:`chainwave.open`, for paths.
    threads : int, optional
        All cores when left out; the bits are the same for any number.
    progress : callable, optional
        Called with stage, frames done and frames planned.

    Returns
    -------
    Tracks
        Positions of the subsets' centres in pixels, pixel (0, 0) being the centre of the top left one. Lost positions are null, with
        the reason in `status`.

    Examples
    --------
    A texture that moves by 1 px a frame to the right:

    >>> import chainwave as cw
    >>> import numpy as np
    >>> wave = np.arange(1, 41)
    >>> y, x = np.mgrid[:64, :80]
    >>> angle = 0.9 * (np.sin(wave) * x[..., None] + np.sin(2 * wave + 1) * y[..., None]) + wave**2
    >>> texture = 2000.0 + 150.0 * np.sin(angle).sum(axis=-1)
    >>> film = np.array([np.roll(texture, k, axis=1) for k in range(3)])
    >>> points = [{"name": "a", "x_px": 32, "y_px": 32, "half_width_px": 12, "half_height_px": 12}]
    >>> tracks = cw.track(film, points)
    >>> tracks["x_px"].round(2).tolist()
    [32.0, 33.0, 34.0]
    >>> tracks["x_px"].shape, tracks["status"].tolist()
    ((3,), ['ok', 'ok', 'ok'])

    Warns
    -----
    ChainwaveWarning
        Contradictions within recordings, points outside the frames, sharp edges beside subsets, and tracks in which every point is lost.
    """
    options = {"rate_hz": rate_hz, "raw": raw, "partial": partial, "dark": dark, "flat": flat}
    given = isinstance(recording, (list, tuple)) and all(is_path(one) or isinstance(one, Recording) for one in recording)
    recordings = [as_recording(one, **options) for one in (recording if given else [recording])]
    if not recordings:
        raise ChainwaveError("recording: expected a recording or a list of them, found an empty list")
    inner, notes, subsets, methods = _chainwave.track(
        [(one.path, one._inner) for one in recordings],
        table_argument(points, "points"),
        _matching(method, accuracy, shape, interpolation, threads),
        reference=whole(reference, 0, "reference"),
        progress=progress,
    )
    for note in dict.fromkeys(f"{name}: {note}" for name, note in notes):
        warn(note)
    tracks = Tracks(inner, [Subset(*subset) for subset in subsets], methods)
    elsewhere = (tracks["frame"] != reference) | (max(len(one) for one in recordings) == 1)
    if not bool(((tracks["status"] == "ok") & elsewhere).any()):
        warn("every point is lost in every frame but the reference: the column status has the reasons")
    return tracks


def correlate(
    reference: Any,
    deformed: Any,
    *,
    step: Optional[int] = None,
    half_size: Optional[int] = None,
    method: Optional[str] = None,
    accuracy: Optional[float] = None,
    shape: Optional[str] = None,
    interpolation: Optional[str] = None,
    strain_window: int = 5,
    rate_hz: Optional[float] = None,
    raw: Optional[str] = None,
    partial: bool = False,
    dark: Optional[Path] = None,
    flat: Optional[Path] = None,
    threads: Optional[int] = None,
    progress: Optional[Progress] = None,
) -> Field:
    """Find the displacement field between two pictures, with the same bits as ``chainwave correlate``.

    Parameters
    ----------
    reference, deformed : Recording, path or array_like
        The pictures: the first frames of recordings, or arrays of shape ``(height, width)``.
    step : int, optional
        Pixels from one point to the next; half of the half size when left out.
    half_size : int, optional
        Columns and rows of a subset on each side of its centre; chosen by the texture, the frame and the field when left out.
    method, accuracy, shape, interpolation, threads, progress
        As for :func:`track`; one of the icgn methods.
    strain_window : int, optional
        Points along one side of the square that a strain is measured over; an odd number.
    rate_hz, raw, partial, dark, flat
        As for :func:`chainwave.open`, for paths.

    Returns
    -------
    Field
        Displacements in pixels, x to the right and y down, and strains; lost points are null, with the reason in `status`.

    Examples
    --------
    >>> import chainwave as cw
    >>> import numpy as np
    >>> wave = np.arange(1, 41)
    >>> y, x = np.mgrid[:64, :80]
    >>> angle = 0.9 * (np.sin(wave) * x[..., None] + np.sin(2 * wave + 1) * y[..., None]) + wave**2
    >>> texture = 2000.0 + 150.0 * np.sin(angle).sum(axis=-1)
    >>> field = cw.correlate(texture, np.roll(texture, 1, axis=1), half_size=10, step=10)
    >>> u_px = field.grid("u_px")
    >>> u_px.shape == (len(field) // field.n_columns, field.n_columns)
    True
    >>> bool(np.nanmax(np.abs(u_px - 1.0)) < 0.01)
    True
    """
    options = {"rate_hz": rate_hz, "raw": raw, "partial": partial, "dark": dark, "flat": flat}
    pictures = [as_recording(picture, **options) for picture in (reference, deformed)]
    half_size = None if half_size is None else whole(half_size, 2, "half_size", 500)
    step = None if step is None else whole(step, 1, "step")
    found = _chainwave.correlate(
        pictures[0]._inner,
        pictures[1]._inner,
        _matching(method, accuracy, shape, interpolation, threads),
        step_px=step,
        half_px=half_size,
        strain_window=whole(strain_window, 0, "strain_window"),
        progress=progress,
    )
    return Field(*found)
