"""The inside of the module: the library crates, callable. Users import `chainwave`."""

from collections.abc import Callable
from typing import Any, final

__all__ = [
    "ArrowTable",
    "Drawing",
    "ExperimentResults",
    "FrameView",
    "MergedMotion",
    "OpenedRecording",
    "PreparedExperiment",
    "__version__",
    "columns_of_csv",
    "correlate",
    "fit",
    "fit_contact",
    "measure_motion",
    "merge",
    "open",
    "read_text",
    "recording_of_counts",
    "simulate",
    "toml_of_dict",
    "track",
]

__version__: str

_Columns = list[tuple[str, list[Any]]]
_Progress = Callable[[str, int, int], object]
_Told = tuple[float, float, tuple[float, float]]

@final
class OpenedRecording:
    @property
    def path(self) -> str: ...
    @property
    def pixel(self) -> str: ...
    def info(self) -> str: ...
    def times(self) -> bytes: ...
    def read(self, frame: int, x: int, y: int, width: int, height: int) -> bytearray: ...
    def view(self, frame: int) -> FrameView | None: ...
    def sheet(self, n_frames: int, tile_width_px: int) -> tuple[int, int, bytes]: ...

@final
class FrameView:
    @property
    def __array_interface__(self) -> dict[str, Any]: ...

@final
class ArrowTable:
    def __len__(self) -> int: ...
    @property
    def columns(self) -> list[str]: ...
    def kind(self, name: str) -> str: ...
    def raw(self, name: str) -> tuple[bytes, bytes | None]: ...
    def texts(self, name: str) -> list[str]: ...
    def __arrow_c_schema__(self) -> object: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...

@final
class Drawing:
    def svg(self) -> str: ...
    def data(self) -> list[tuple[str, str, str, str, str, ArrowTable]]: ...

_Number = tuple[_Told | None, str | None]

@final
class PreparedExperiment:
    def __new__(
        cls,
        path: str,
        text: str,
        *,
        recordings: str | None = None,
        trials: _Columns | None = None,
        partial: bool = False,
    ) -> PreparedExperiment: ...
    def with_recordings(self, held: list[tuple[str, OpenedRecording]]) -> PreparedExperiment: ...
    @property
    def rate_hz(self) -> float | None: ...
    def __len__(self) -> int: ...
    @property
    def velocities(self) -> list[float]: ...
    @property
    def name(self) -> str: ...
    @property
    def recordings(self) -> list[str]: ...
    def check(self, *, n_threads: int | None = None) -> list[tuple[str, str, str]]: ...
    def run(
        self, striker: int, *, n_threads: int | None = None, progress: _Progress | None = None
    ) -> ExperimentResults: ...

@final
class ExperimentResults:
    @property
    def striker_velocity_m_per_s(self) -> float | None: ...
    @property
    def numbers(self) -> list[tuple[str, _Number]]: ...
    @property
    def tables(self) -> list[tuple[str, ArrowTable]]: ...
    @property
    def figures(self) -> list[tuple[str, Drawing]]: ...
    @property
    def warnings(self) -> list[tuple[str, str, str]]: ...
    @property
    def recordings(self) -> list[tuple[str, int, int, str, str | None]]: ...
    @property
    def details(self) -> str: ...
    @property
    def decisions(self) -> str: ...

@final
class MergedMotion: ...

def columns_of_csv(path: str) -> _Columns: ...
def merge(
    tracks: str | _Columns,
    *,
    n_bodies: int | None,
    rest_until_s: float,
    drive_scatter: float | None,
    trigger_sigma_s: float | None,
    view_trigger_sigma_s: float | None,
) -> tuple[MergedMotion, ArrowTable, str, list[str]]: ...
def measure_motion(
    motion: MergedMotion | str | _Columns, measuring: dict[str, Any]
) -> tuple[list[tuple[str, _Number]], list[tuple[str, ArrowTable]], list[tuple[str, Drawing]]]: ...
def fit(
    merged: MergedMotion,
    path: str,
    text: str,
    *,
    striker_velocity_sigma_m_per_s: float,
    n_threads: int | None,
) -> tuple[list[tuple[str, _Number]], str, list[str]]: ...
def open(
    path: str,
    *,
    rate_hz: float | None = None,
    raw: str | None = None,
    partial: bool = False,
    dark: str | None = None,
    flat: str | None = None,
) -> OpenedRecording: ...
def recording_of_counts(
    counts: bytes,
    *,
    width_px: int,
    height_px: int,
    bit_depth: int,
    name: str,
    pixel: str,
    times_s: list[float] | None = None,
    rate_hz: float | None = None,
) -> OpenedRecording: ...
def track(
    recordings: list[tuple[str, OpenedRecording]],
    points: str | _Columns,
    matching: dict[str, Any],
    *,
    reference: int,
    progress: _Progress | None = None,
) -> tuple[ArrowTable, list[tuple[str, str]], list[tuple[str, str, int, int, str | None]], list[str]]: ...
def correlate(
    reference: OpenedRecording,
    deformed: OpenedRecording,
    matching: dict[str, Any],
    *,
    step_px: int | None,
    half_px: int | None,
    strain_window: int,
    progress: _Progress | None = None,
) -> tuple[ArrowTable, int, int, int, str, str | None]: ...
def simulate(path: str, text: str) -> tuple[ArrowTable, str]: ...
def fit_contact(curve: str | _Columns, zero: str) -> tuple[list[tuple[str, _Told]], str]: ...
def toml_of_dict(tables: dict[str, Any]) -> str: ...
def read_text(path: str) -> str: ...
