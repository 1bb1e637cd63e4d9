"""Recordings as arrays."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import chainwave as cw
import numpy as np
import pytest


def test_frames_are_arrays_of_counts(recording: Path, frames: Any) -> None:
    opened = cw.open(recording)
    assert opened.shape == frames.shape and len(opened) == 8 and opened.dtype == np.uint16
    assert np.array_equal(opened[3], frames[3])
    assert np.array_equal(opened[-1], frames[-1])
    assert np.array_equal(opened[2:7:2], frames[2:7:2])
    assert np.array_equal(opened[::-1], frames[::-1])
    assert np.array_equal(opened[1, 10:20, 30:50], frames[1, 10:20, 30:50])
    assert np.array_equal(opened[1, 20:4:-3, 7], frames[1, 20:4:-3, 7])
    assert opened[3:3].shape == (0, 80, 96)
    assert np.array_equal(opened.read_region(1, x=30, y=10, width=20, height=11), frames[1, 10:21, 30:50])
    assert np.array_equal(np.asarray(opened), frames)
    assert [frame.sum() for frame in opened] == [frame.sum() for frame in frames]
    with pytest.raises(IndexError, match="frame 8"):
        opened[8]
    with pytest.raises(cw.ChainwaveError, match="expected one inside 96 x 80 px"):
        opened.read_region(0, x=90, y=0, width=7, height=1)


def test_a_recording_says_what_inspect_says(recording: Path, command: str) -> None:
    told = subprocess.run([command, "inspect", recording, "--json", "--rate-hz", "1e5"], check=True, capture_output=True)
    expected = json.loads(told.stdout)
    del expected["survey"]
    opened = cw.open(recording, rate_hz=1e5)
    assert opened.metadata == expected
    assert opened.times_s[-1] == expected["last_time_s"] and opened.rate_hz == 1e5


def test_bytes_stay_bytes(tmp_path: Path) -> None:
    bytes_of = np.arange(60, dtype=np.uint8).reshape(1, 6, 10)
    np.save(tmp_path / "bytes.npy", bytes_of)
    opened = cw.open(tmp_path / "bytes.npy")
    assert opened.dtype == np.uint8 and np.array_equal(opened[0], bytes_of[0])


def test_frames_of_whole_bytes_are_views_of_the_file(recording: Path, frames: Any, tmp_path: Path) -> None:
    opened = cw.open(recording)
    first, again = opened[3], opened[3]
    address = first.__array_interface__["data"][0]
    assert again.__array_interface__["data"][0] == address and not first.flags.writeable
    assert opened[4].__array_interface__["data"][0] == address + frames[0].nbytes
    part = opened[3, 10:20, 30:50]
    assert part.__array_interface__["data"][0] == address + 2 * (10 * 96 + 30)
    del opened, again, part
    # The array keeps the file open.
    assert np.array_equal(first, frames[3])
    # What is stored high byte first is read, as arrays have the machine's order.
    np.save(tmp_path / "big.npy", frames.astype(">u2"))
    big = cw.open(tmp_path / "big.npy")
    assert big[3].dtype == np.uint16 and np.array_equal(big[3], frames[3])


@pytest.mark.parametrize("depth", ["16le", "12p"])
def test_only_the_asked_rows_are_read(depth: str, tmp_path: Path) -> None:
    """Of a file larger than any memory here, sparse so that no disk need hold it."""
    n_frames, row_bytes = 40_000, 1280 * (2 if depth == "16le" else 1.5)
    path = tmp_path / "film.raw"
    with path.open("wb") as file:
        try:
            file.truncate(int(n_frames * 800 * row_bytes))
        except OSError:
            pytest.skip("the disk holds no sparse files of 80 GB")
        # Row 400 of frame 30000: a count of 0x101 in each pixel, packed or not.
        file.seek(int((30_000 * 800 + 400) * row_bytes))
        file.write(bytes([0x01, 0x01]) * 1280 if depth == "16le" else bytes([0x10, 0x11, 0x01]) * 640)
    opened = cw.open(path, raw=f"1280x800x{depth}", rate_hz=1e5)
    assert opened.shape == (n_frames, 800, 1280)
    found = opened[30_000, 399:402, 100:104]
    assert found.tolist() == [[0] * 4, [0x101] * 4, [0] * 4]


def test_arrays_are_recordings(frames: Any) -> None:
    of_array = cw.Recording.from_array(frames, rate_hz=1e5)
    assert np.array_equal(of_array[2], frames[2]) and of_array.bit_depth == 16
    assert np.allclose(of_array.times_s, np.arange(8) / 1e5)
    floats = cw.Recording.from_array(frames[0] / 3.0)
    assert floats.dtype == np.float32 and len(floats) == 1
    with pytest.raises(cw.ChainwaveError, match="finite"):
        cw.Recording.from_array(np.full((4, 4), np.nan))
    with pytest.raises(cw.ChainwaveError, match="shape"):
        cw.Recording.from_array(np.zeros(4))


def test_notebooks_see_frames(recording: Path) -> None:
    shown = cw.open(recording)._repr_html_()
    assert "data:image/png;base64," in shown and "8 frames of 96 x 80 px" in shown
    assert "96 x 80 px" in repr(cw.open(recording))


def test_what_is_wrong_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="nowhere.cine"):
        cw.open(tmp_path / "nowhere.cine")
    with pytest.raises(cw.ChainwaveError, match="nowhere.cine"):
        cw.open(str(tmp_path / "nowhere.cine"))
    (tmp_path / "text.cine").write_text("no recording")
    with pytest.raises(ValueError, match="expected the start of a recording, found bytes"):
        cw.open(tmp_path / "text.cine")
    with pytest.raises(cw.ChainwaveError, match="geometry"):
        cw.open(tmp_path / "text.cine", raw="wide")
