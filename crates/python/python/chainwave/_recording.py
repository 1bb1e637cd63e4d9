"""Recordings: frames of counts, read when they are asked for."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Optional, Union, overload

from . import _chainwave
from ._columns import Path, is_path, whole
from ._errors import ChainwaveError, ChainwaveWarning

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    _Counts = NDArray[Any]


class Recording:
    """A sequence of monochrome frames.

    ``recording[k]`` is frame ``k`` as a NumPy array of linear counts, shape ``(height_px, width_px)``, top row first: ``uint8`` of
    at most 8 bits, else ``uint16``; ``float32`` where counts are not whole (a float array, or a recording whose dark level and
    gains were taken out). ``recording[-1]`` is the last frame, ``recording[10:20]`` a stack of shape
    ``(10, height_px, width_px)``, and ``recording[k, 40:80, 100:200]`` reads only rows 40 to 79 of columns 100 to 199.

    Opening reads only the header; uncompressed files are memory-mapped, so reading a region touches only its rows. Where the file holds 8 or 16 bits
    a pixel as they are, a frame is a view of the file itself, without a copy, that cannot be written to: take ``.copy()`` for that.

    Recordings come from :func:`chainwave.open` and :meth:`Recording.from_array`.
    """

    def __init__(self, inner: _chainwave.OpenedRecording) -> None:
        self._inner = inner
        import json

        self._info: dict[str, Any] = json.loads(inner.info())

    @classmethod
    def from_array(
        cls,
        frames: ArrayLike,
        *,
        rate_hz: Optional[float] = None,
        times_s: Optional[ArrayLike] = None,
        bit_depth: Optional[int] = None,
        name: Path = "array",
    ) -> Recording:
        """A recording of frames in memory.

        Parameters
        ----------
        frames : array_like
            Counts, shape ``(n_frames, height, width)`` or ``(height, width)``. Subsets are matched in ``float32``, exact for whole
            counts below 2\\ :sup:`24`.
        rate_hz : float, optional
            Frames per second; without it, and without `times_s`, times count frames.
        times_s : array_like, optional
            Time of each frame after the trigger, in seconds, shape ``(n_frames,)``.
        bit_depth : int, optional
            Significant bits of a count: pixels at ``2**bit_depth - 1`` are saturated and left out of subsets. 8 or 16 of
            arrays of such integers when left out; others then never saturate.
        name : path, optional
            What stands for the path in tables and messages.

        Examples
        --------
        >>> import chainwave as cw
        >>> import numpy as np
        >>> film = cw.Recording.from_array(np.zeros((3, 48, 64), dtype=np.uint8), rate_hz=1000)
        >>> len(film), film[0].shape, film.bit_depth, film.times_s.tolist()
        (3, (48, 64), 8, [0.0, 0.001, 0.002])
        """
        import numpy as np

        array = np.asarray(frames)
        if array.ndim == 2:
            array = array[np.newaxis]
        if array.ndim != 3 or array.size == 0 or array.dtype.kind not in "uifb":
            raise ChainwaveError(
                f"{os.fspath(name)}: expected frames of numbers, shape (n_frames, height, width) or (height, width), "
                f"found {array.dtype} of shape {array.shape}"
            )
        pixel = {"|u1": "u1", "u1": "u1", "u2": "u2"}.get(array.dtype.str.lstrip("<>="), "f4")
        usual = {"u1": 8, "u2": 16}.get(pixel, 32)
        counts = np.ascontiguousarray(array, dtype=np.float32)
        if not bool(np.isfinite(counts).all()):
            raise ChainwaveError(f"{os.fspath(name)}: expected finite counts, found NaN or infinity")
        times = None if times_s is None else [float(time_s) for time_s in np.asarray(times_s).ravel()]
        inner = _chainwave.recording_of_counts(
            counts.tobytes(),
            width_px=int(array.shape[2]),
            height_px=int(array.shape[1]),
            bit_depth=usual if bit_depth is None else whole(bit_depth, 1, "bit_depth", 32),
            name=os.fspath(name),
            pixel=pixel,
            times_s=times,
            rate_hz=rate_hz,
        )
        return cls(inner)

    @property
    def path(self) -> str:
        """Where the recording lies."""
        return self._inner.path

    @property
    def metadata(self) -> dict[str, Any]:
        """What the recording says of itself, with the keys of ``chainwave inspect --json``: `format`, `width_px`, `height_px`,
        `n_frames`, `bit_depth`, `rate_hz`, `first_time_s`, `last_time_s`, `first_image`, `camera`, `exposure_s`, `warnings`."""
        return dict(self._info)

    @property
    def width_px(self) -> int:
        """Columns of a frame."""
        return int(self._info["width_px"])

    @property
    def height_px(self) -> int:
        """Rows of a frame."""
        return int(self._info["height_px"])

    @property
    def n_frames(self) -> int:
        """Number of frames."""
        return int(self._info["n_frames"])

    @property
    def bit_depth(self) -> int:
        """Significant bits of a count."""
        return int(self._info["bit_depth"])

    @property
    def rate_hz(self) -> Optional[float]:
        """Frames per second; ``None`` where nobody states it."""
        rate_hz = self._info["rate_hz"]
        return None if rate_hz is None else float(rate_hz)

    @property
    def exposure_s(self) -> Optional[float]:
        """Exposure of a frame, in seconds; ``None`` where it is not stated."""
        exposure_s = self._info["exposure_s"]
        return None if exposure_s is None else float(exposure_s)

    @property
    def camera(self) -> Optional[str]:
        """Camera model, where the file names it."""
        camera = self._info["camera"]
        return None if camera is None else str(camera)

    @property
    def first_image(self) -> int:
        """The camera's number of the first frame; the trigger is image 0."""
        return int(self._info["first_image"])

    @property
    def format(self) -> str:
        """File format and packing."""
        return str(self._info["format"])

    @property
    def warnings(self) -> list[str]:
        """What the file says against itself."""
        return [str(warning) for warning in self._info["warnings"]]

    @property
    def times_s(self) -> NDArray[np.float64]:
        """Time of each frame after the trigger, in seconds, shape ``(n_frames,)``."""
        import numpy as np

        return np.frombuffer(self._inner.times(), dtype=np.float64)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Frames, rows, columns."""
        return self.n_frames, self.height_px, self.width_px

    @property
    def ndim(self) -> int:
        """3."""
        return 3

    @property
    def dtype(self) -> np.dtype[Any]:
        """What a pixel is: ``uint8``, ``uint16`` or ``float32``."""
        import numpy as np

        return np.dtype(self._inner.pixel)

    def __len__(self) -> int:
        """Number of frames."""
        return self.n_frames

    def __iter__(self) -> Iterator[_Counts]:
        """The frames, one after the other."""
        return (self[frame] for frame in range(len(self)))

    def read_region(self, frame: int, x: int, y: int, width: int, height: int) -> _Counts:
        """Counts of a rectangle of a frame; only its rows are read.

        Parameters
        ----------
        frame : int
            Number of the frame, from 0; negative from the end.
        x, y : int
            First column and first row, in pixels.
        width, height : int
            Number of columns and rows.

        Returns
        -------
        ndarray
            Shape ``(height, width)``.
        """
        import numpy as np

        if min(x, y, width, height) < 0:
            raise ChainwaveError(f"{self.path}: region {(x, y, width, height)}: expected numbers from 0")
        number = self._frame(frame)
        view = self._inner.view(number)
        if view is not None and x + width <= self.width_px and y + height <= self.height_px:
            shown: _Counts = np.asarray(view)[y : y + height, x : x + width]
            return shown
        counts = self._inner.read(number, x, y, width, height)
        return np.frombuffer(counts, dtype=self.dtype).reshape(height, width)

    def _frame(self, frame: int) -> int:
        number = frame + len(self) if frame < 0 else frame
        if not 0 <= number < len(self):
            raise IndexError(f"{self.path}: frame {frame}: expected one of {len(self)}")
        return number

    @overload
    def __getitem__(self, key: int) -> _Counts: ...

    @overload
    def __getitem__(self, key: slice) -> _Counts: ...

    @overload
    def __getitem__(self, key: tuple[Union[int, slice], ...]) -> _Counts: ...

    def __getitem__(self, key: Union[int, slice, tuple[Union[int, slice], ...]]) -> _Counts:
        """Frames by number or slice, and regions of them: ``recording[frames, rows, columns]``."""
        import operator

        import numpy as np

        keys: tuple[Union[int, slice], ...] = key if isinstance(key, tuple) else (key,)
        if not 1 <= len(keys) <= 3:
            raise IndexError(f"expected one to three indices, frames, rows, columns, found {len(keys)}")
        padded = [*keys, slice(None), slice(None)]
        frames, rows, columns = padded[0], padded[1], padded[2]
        y, height, row_key = _extent(rows, self.height_px)
        x, width, column_key = _extent(columns, self.width_px)

        def one(frame: int) -> _Counts:
            region = self.read_region(frame, x, y, width, height)
            found: _Counts = region[row_key, column_key]
            return found

        if isinstance(frames, slice):
            numbers = range(*frames.indices(len(self)))
            if numbers:
                return np.stack([one(number) for number in numbers])
            empty = np.empty((height, width), dtype=self.dtype)[row_key, column_key]
            return np.empty((0, *empty.shape), dtype=self.dtype)
        return one(operator.index(frames))

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> _Counts:
        """All frames, shape ``(n_frames, height_px, width_px)``; they are read."""
        import numpy as np

        if copy is False:
            raise ValueError("frames are read from the recording, which makes a copy")
        frames = self[:]
        return frames if dtype is None else np.asarray(frames, dtype=dtype)

    def __repr__(self) -> str:
        rate = "rate not stated" if self.rate_hz is None else f"{self.rate_hz:.6g} Hz"
        size = f"{self.n_frames} frames of {self.width_px} x {self.height_px} px, {self.bit_depth} bit"
        return f"<chainwave.Recording {self.path!r}: {self.format}, {size}, {rate}>"

    def _repr_html_(self) -> str:
        import base64
        import html

        width, height, gray = self._inner.sheet(6, 160)
        picture = base64.b64encode(_png(width, height, gray)).decode()
        caption = html.escape(repr(self).strip("<>"))
        return f'<figure><img alt="frames" src="data:image/png;base64,{picture}"/><figcaption>{caption}</figcaption></figure>'


def _extent(key: Union[int, slice], n: int) -> tuple[int, int, Union[int, slice]]:
    """First row (or column), how many are read, and what of them is taken."""
    import operator

    if isinstance(key, slice):
        numbers = range(*key.indices(n))
        if not numbers:
            return 0, 0, slice(None)
        first, last = min(numbers), max(numbers)
        return first, last - first + 1, slice(None, None, numbers.step)
    number = operator.index(key)
    number = number + n if number < 0 else number
    if not 0 <= number < n:
        raise IndexError(f"expected a row or column of {n}, found {key}")
    return number, 1, 0


def _png(width: int, height: int, gray: bytes) -> bytes:
    """A picture of 8-bit gray levels as PNG."""
    import struct
    import zlib

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + gray[row * width : (row + 1) * width] for row in range(height))
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def open(
    path: Path,
    *,
    rate_hz: Optional[float] = None,
    raw: Optional[str] = None,
    partial: bool = False,
    dark: Optional[Path] = None,
    flat: Optional[Path] = None,
) -> Recording:
    """Open a recording: .cine, .mraw (its .cih or .cihx beside it), TIFF stack, folder of images, image, .npy or raw pixels.

    Parameters
    ----------
    path : path
        The file or folder; its format is found from its first bytes.
    rate_hz : float, optional
        Frames per second of recordings that do not state them.
    raw : str, optional
        Geometry of pixels without a header, such as ``"1280x800x12le"``.
    partial : bool, optional
        Take the whole frames of a recording that was cut short.
    dark, flat : path, optional
        Dark frames and frames of an evenly lit field, whose level and gains are taken out; counts are then ``float32``.

    Returns
    -------
    Recording
        Frames of linear counts, each of shape ``(height_px, width_px)``, and their times in seconds after the trigger.

    Examples
    --------
    >>> import chainwave as cw
    >>> import numpy as np
    >>> import pathlib, tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = pathlib.Path(folder.name) / "film.npy"
    >>> np.save(path, np.arange(24, dtype=np.uint16).reshape(2, 3, 4))
    >>> film = cw.open(path, rate_hz=1e5)
    >>> film.shape, film.times_s.tolist()
    ((2, 3, 4), [0.0, 1e-05])
    >>> film[1, 1:3, 2:4].tolist()
    [[18, 19], [22, 23]]
    >>> del film
    >>> folder.cleanup()

    Raises
    ------
    MissingFileError
        There is no such file.
    ChainwaveError
        A file that is no recording, or contradicts itself.
    """
    inner = _chainwave.open(
        os.fspath(path),
        rate_hz=rate_hz,
        raw=raw,
        partial=partial,
        dark=None if dark is None else os.fspath(dark),
        flat=None if flat is None else os.fspath(flat),
    )
    return Recording(inner)


def as_recording(value: Any, **options: Any) -> Recording:
    """A recording of what stands for one: itself, a path, or an array."""
    if isinstance(value, Recording):
        return value
    if is_path(value):
        return open(value, **options)
    return Recording.from_array(value, rate_hz=options.get("rate_hz"))


def warn(message: str, stacklevel: int = 3) -> None:
    """Tells what a careful reader should know."""
    import warnings

    warnings.warn(message, ChainwaveWarning, stacklevel=stacklevel + 1)
