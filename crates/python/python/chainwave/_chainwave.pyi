"""The inside of the module: the library crates, callable. Users import `chainwave`."""

from collections.abc import Callable, Sequence
from typing import Any, final

__version__: str

_Cells = Sequence[float | None] | Sequence[str]
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
    def sheet(self, n_frames: int, tile_width_px: int) -> tuple[int, int, bytes]: ...

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
def toml_of_json(text: str) -> str: ...
def read_text(path: str) -> str: ...
