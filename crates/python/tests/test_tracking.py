"""Tracks and fields: the truth, and the same bits as the command's."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path
from typing import Any

import chainwave as cw
import numpy as np
import polars
import pytest
from conftest import SHIFT_PX, film
from polars.testing import assert_frame_equal

COLUMNS = (
    "recording name frame t_s x_px y_px sigma_x_px sigma_y_px theta_rad sigma_theta_rad zncc iterations status method"
)


def test_points_are_found_where_they_are(frames: Any) -> None:
    tracks = cw.track(frames, {"name": ["a"], "x_px": [40.0], "y_px": [40.0], "half_width_px": [15], "half_height_px": [15]})
    assert tracks.columns == COLUMNS.split() and len(tracks) == 8
    assert set(tracks["status"]) == {"ok"}
    error_px = tracks["x_px"] - 40.0 - SHIFT_PX * tracks["frame"]
    # Rounding to whole counts is noise of 0.3 counts on some 700 counts of contrast; interpolation errs by no more than a hundredth.
    assert np.abs(error_px).max() < 0.01 and np.abs(tracks["y_px"] - 40.0).max() < 0.01
    assert tracks.subsets == [cw.Subset("array", "a", 15, 15, None)]


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"method": "icgn-cubic-translation"},
        {"accuracy": 0.02},
        {"shape": "auto", "interpolation": "cubic", "reference": 2},
    ],
)
def test_tracks_have_the_bits_of_the_command(
    recording: Path, points: Path, command: str, tmp_path: Path, options: dict[str, Any]
) -> None:
    out = tmp_path / "tracks.parquet"
    asked = [text for name, value in options.items() for text in (f"--{name}", str(value))]
    subprocess.run([command, "track", recording, "--points", points, "--out", out, *asked], check=True)
    with pytest.warns(cw.ChainwaveWarning, match="frame rate"):
        tracks = cw.track(recording, points, **options)
    assert_frame_equal(polars.DataFrame(tracks), polars.read_parquet(out), check_exact=True)


@pytest.mark.filterwarnings("ignore::chainwave.ChainwaveWarning")
def test_ways_to_give_points_and_recordings_agree(recording: Path, points: Path, frames: Any) -> None:
    usual = polars.DataFrame(cw.track(recording, points)).drop("recording")
    rows = [
        {"name": "a", "x_px": 30, "y_px": 40, "half_width_px": 12, "half_height_px": 12},
        {"name": "b", "x_px": 60, "y_px": 40, "half_width_px": 10, "half_height_px": 14},
        {"name": "c", "x_px": 45, "y_px": 25},
    ]
    table = polars.DataFrame(rows)
    for of_recording in (recording, str(recording), cw.open(recording), frames):
        for of_points in (points, rows, table, table.to_dict(as_series=False), table.to_pandas()):
            tracks = polars.DataFrame(cw.track(of_recording, of_points, threads=1)).drop("recording")
            assert_frame_equal(tracks, usual, check_exact=True)
    both = polars.DataFrame(cw.track([recording, cw.open(recording)], points))
    assert len(both) == 2 * len(usual)


def test_lost_points_are_null_in_arrow_and_nan_in_numpy(frames: Any) -> None:
    outside = {"name": ["out", "in"], "x_px": [1.0, 40.0], "y_px": [1.0, 40.0], "half_width_px": [9, 9], "half_height_px": [9, 9]}
    with pytest.warns(cw.ChainwaveWarning, match="reaches outside the image"):
        tracks = cw.track(frames, outside)
    table = polars.DataFrame(tracks)
    assert table["x_px"].null_count() == 8 and table["iterations"].dtype == polars.UInt32
    assert set(table.filter(polars.col("name") == "out")["status"]) == {"out_of_view"}
    assert np.isnan(tracks["x_px"]).sum() == 8 and np.isnan(tracks["iterations"]).sum() == 8


def test_wrong_points_are_named(recording: Path, tmp_path: Path) -> None:
    with pytest.raises(cw.ChainwaveError, match="each name once, found a"):
        cw.track(recording, {"name": ["a", "a"], "x_px": [1, 2], "y_px": [1, 2]})
    with pytest.raises(cw.ChainwaveError, match="a column named x_px, found name"):
        cw.track(recording, {"name": ["a"]})
    (tmp_path / "points.csv").write_text("name,x_px,y_px\na,1,one\n")
    with pytest.raises(cw.ChainwaveError, match=r"points.csv, line 2, column y_px: expected a number, found \"one\""):
        cw.track(recording, tmp_path / "points.csv")
    with pytest.raises(cw.ChainwaveError, match="expected one of"):
        cw.track(recording, {"name": ["a"], "x_px": [40], "y_px": [40]}, method="magic")
    with pytest.raises(cw.ChainwaveError, match="points, row 0, column x_px: expected a number, found infinity"):
        cw.track(recording, {"name": ["a"], "x_px": [np.inf], "y_px": [40]})
    with pytest.raises(FileNotFoundError):
        cw.track(recording, tmp_path / "nowhere.csv")


def test_a_field_has_the_bits_of_the_command(frames: Any, command: str, tmp_path: Path) -> None:
    for name, picture in (("one", frames[0]), ("two", frames[4])):
        np.save(tmp_path / f"{name}.npy", picture[np.newaxis])
    for options in ({}, {"step": 6, "half-size": 9}, {"half-size": 8, "shape": "translation"}):
        asked = [text for name, value in options.items() for text in (f"--{name}", str(value))]
        out = tmp_path / "field.parquet"
        subprocess.run(
            [command, "correlate", tmp_path / "one.npy", tmp_path / "two.npy", "--out", out, *asked], check=True
        )
        named = {name.replace("-", "_"): value for name, value in options.items()}
        field = cw.correlate(tmp_path / "one.npy", tmp_path / "two.npy", **named)
        assert_frame_equal(polars.DataFrame(field), polars.read_parquet(out), check_exact=True)
        of_arrays = cw.correlate(frames[0], frames[4], **named)
        assert_frame_equal(polars.DataFrame(of_arrays), polars.DataFrame(field), check_exact=True)
        assert np.nanmax(np.abs(field.grid("u_px") - 4 * SHIFT_PX)) < 0.05


def test_progress_is_told_and_may_end_the_work() -> None:
    frames, points = film(200, 160, 120), [{"name": "a", "x_px": 60, "y_px": 60, "half_width_px": 30, "half_height_px": 30}]
    told: list[tuple[str, int, int]] = []
    cw.track(frames, points, threads=1, progress=lambda *news: told.append(news))
    assert told[-1] == ("tracking", 200, 200)

    class Enough(Exception):
        """Ends the work."""

    def stop(stage: str, done: int, planned: int) -> None:
        raise Enough(f"{stage} at {done} of {planned}")

    start = time.perf_counter()
    with pytest.raises(Enough):
        cw.track(frames, points, threads=1, progress=stop)
    assert time.perf_counter() - start < 5.0
