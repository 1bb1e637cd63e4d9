"""The pieces, and the notebooks that show them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import chainwave as cw
import numpy as np
import polars
import pytest
from conftest import REPOSITORY, SHIFT_PX

NOTEBOOKS = REPOSITORY / "pipelines" / "notebooks"
LATE_S = 20e-6


def trial(number: int, late_s: float) -> dict[str, Any]:
    """Two bodies that start one after the other, seen every 0.1 ms to a micrometre."""
    t_s = np.arange(-20, 60) * 1e-4
    noise_m = np.random.default_rng(number).normal(0.0, 1e-6, (2, t_s.size))
    x_m = [2000.0 * np.clip(t_s - late_s - delay_s, 0.0, None) ** 2 + own for delay_s, own in zip((0.0, 4e-4), noise_m)]
    return {
        "trial": np.full(2 * t_s.size, number),
        "body": np.repeat([1, 2], t_s.size),
        "t_s": np.tile(t_s, 2),
        "x_m": np.concatenate(x_m),
        "sigma_m": np.full(2 * t_s.size, 1e-6),
    }


def test_trials_are_merged_and_their_triggers_found() -> None:
    trials = [trial(1, 0.0), trial(2, LATE_S), trial(3, 0.0)]
    merged = cw.merge(trials, rest_until_s=-1e-4, drive_scatter=0.02)
    offsets_s = np.array([one["trigger_offset_s"] for one in merged.alignments])
    # A micrometre at a velocity of some metres a second is a microsecond, and each trial has a hundred readings.
    assert np.abs(offsets_s - np.mean(offsets_s) - (np.array([0.0, LATE_S, 0.0]) - LATE_S / 3)).max() < 2e-6
    table = polars.DataFrame(merged)
    assert table.columns[:4] == ["t_s", "body", "x_m", "sigma_m"] and set(table["n_trials"]) <= {1, 2, 3}
    together = polars.concat([polars.DataFrame(one) for one in trials])
    again = cw.merge(together, rest_until_s=-1e-4, drive_scatter=0.02)
    assert np.array_equal(again["x_m"], merged["x_m"])


def test_views_count_their_trials_for_themselves(tmp_path: Path) -> None:
    late_s = {(1, 1): 0.0, (1, 2): LATE_S, (2, 1): LATE_S, (2, 2): 0.0}
    tables = [
        polars.DataFrame({**trial(10 * view + number, late), "trial": np.full(160, number), "view": np.full(160, view)})
        for (view, number), late in late_s.items()
    ]
    # What is not asked for may be anything, with gaps.
    notes = polars.DataFrame({"note": [None, "looked at twice"] * 320, "day": [None] * 640})
    together = polars.concat([polars.concat(tables), notes], how="horizontal")
    merged = cw.merge(together, rest_until_s=-1e-4, drive_scatter=0.02)
    found = {(one["view"], one["recording"]): one["trigger_offset_s"] for one in merged.alignments}
    assert [view for view, _ in found] == [1, 1, 2, 2]
    offsets_s, truth_s = np.array(list(found.values())), np.array(list(late_s.values()))
    # As of trials alone; with one trigger for both first trials these were half of LATE_S off.
    assert np.abs(offsets_s - offsets_s.mean() - truth_s + truth_s.mean()).max() < 3e-6
    with pytest.raises(cw.ChainwaveError, match="a second one"):
        cw.merge(polars.concat([tables[0], tables[0]]), rest_until_s=-1e-4)
    # A file of pixels, scaled.
    pixels = polars.DataFrame(tables[0]).rename({"body": "name", "x_m": "x_px", "sigma_m": "sigma_x_px"})
    pixels.with_columns(polars.col("x_px", "sigma_x_px") * 1e4).write_csv(tmp_path / "tracks.csv")
    in_metres = cw.merge(tables[0], rest_until_s=-1e-4)
    from_file = cw.merge(tmp_path / "tracks.csv", rest_until_s=-1e-4, m_per_px=1e-4)
    assert np.abs(from_file["x_m"] - in_metres["x_m"]).max() < 1e-12


def test_numbers_that_are_none_are_refused(frames: Any) -> None:
    for wrong in (0.0, -5.0, float("nan")):
        with pytest.raises(cw.ChainwaveError, match="rate_hz"):
            cw.Recording.from_array(frames, rate_hz=wrong)
    point = {"name": "1", "x_px": 40, "y_px": 40, "half_width_px": 14, "half_height_px": 14}
    for argument in ({"threads": 0}, {"threads": -1}, {"reference": -1}):
        with pytest.raises(cw.ChainwaveError, match=next(iter(argument))):
            cw.track(frames, [point], **argument)


def test_arguments_that_make_no_sense_are_named(frames: Any) -> None:
    table = {"t_s": np.tile(np.arange(50) * 1e-5, 4), "body": np.repeat(np.arange(1, 5), 50), "x_m": np.zeros(200)}
    wrong: list[dict[str, Any]] = [
        {"first_gap": -1},
        {"last_gap": 0},
        {"seed": -1},
        {"seed": 1.5},
        {"n_replicas": 3},
        {"threads": "a"},
        {"pitch_m": "0.03"},
        {"pitch_m": ["a", 0.03, 0.03]},
        {"edge_fraction": "low"},
    ]
    for arguments in wrong:
        with pytest.raises(ValueError, match=f"{next(iter(arguments))}: expected"):
            cw.measure(table, **{"pitch_m": 0.03, **arguments})
    with pytest.raises(ValueError, match="recording: expected a recording"):
        cw.track([], [{"name": "1", "x_px": 40, "y_px": 40}])
    for bit_depth in (-3, 0, 99, "8"):
        with pytest.raises(ValueError, match="bit_depth: expected a whole number from 1 to 32"):
            cw.Recording.from_array(frames, bit_depth=bit_depth)
    falling = np.arange(len(frames))[::-1] * 1e-4
    with pytest.raises(ValueError, match="times_s, frame 1: expected a time after"):
        cw.Recording.from_array(frames, times_s=falling)


def test_tracks_in_pixels_are_merged_by_their_scale(frames: Any) -> None:
    point = {"name": "1", "x_px": 40, "y_px": 40, "half_width_px": 14, "half_height_px": 14}
    at_rest = np.concatenate([np.repeat(frames[:1], 6, axis=0), frames])
    films = [cw.Recording.from_array(at_rest, times_s=(np.arange(14) - 6) * 1e-4, name=f"film {k}") for k in range(2)]
    merged = cw.merge(cw.track(films, [point]), m_per_px=1e-4, rest_until_s=-1e-5)
    truth_m = 1e-4 * SHIFT_PX * np.clip(merged["t_s"] / 1e-4, 0.0, None)
    # Interpolation of these waves errs by no more than a hundredth of a pixel.
    assert np.abs(merged["x_m"] - truth_m).max() < 1e-6 and merged["t_s"][-1] > 3e-4


def test_a_motion_is_measured_with_and_without_errors() -> None:
    body, t_s = np.meshgrid(np.arange(1, 21), np.arange(0, 400) * 1e-5, indexing="ij")
    # A pulse of compression that travels at 200 m/s without changing its shape.
    x_m = 1e-3 * (1.0 + np.tanh((t_s - 0.03 * (body - 1) / 200.0 - 1e-3) / 2e-4))
    table = {"t_s": t_s.ravel(), "body": body.ravel(), "x_m": x_m.ravel()}
    exact = cw.measure(table, pitch_m=0.03, first_gap=2, last_gap=12)
    assert abs(float(exact.group_velocity_m_per_s) / 200.0 - 1.0) < 1e-3 and exact.group_velocity_m_per_s.sigma == 0.0
    noisy = {**table, "x_m": table["x_m"] + np.random.default_rng(1).normal(0, 5e-6, 8000), "sigma_m": np.full(8000, 5e-6)}
    measured = cw.measure(noisy, pitch_m=[0.03] * 19, first_gap=2, last_gap=12)
    velocity = measured.group_velocity_m_per_s
    assert velocity.sigma is not None and 0 < velocity.sigma < 4.0 and abs(float(velocity) - 200.0) < 4 * velocity.sigma
    assert np.array_equal(cw.strain_map(noisy, pitch_m=0.03)["strain"], measured.strain["strain"])
    assert measured.strain.columns == ["t_s", "gap", "strain", "sigma"] and len(measured.energy) == 0


def test_what_cannot_be_told_is_refused_with_its_reason() -> None:
    table = {"t_s": np.tile(np.arange(50) * 1e-5, 4), "body": np.repeat(np.arange(1, 5), 50), "x_m": np.zeros(200)}
    velocity = cw.measure(table, pitch_m=0.03).group_velocity_m_per_s
    assert velocity.value is None and velocity.refused
    with pytest.raises(cw.ChainwaveError, match="no number"):
        float(velocity)


def test_wrong_tables_are_named() -> None:
    with pytest.raises(cw.ChainwaveError, match="a column named body"):
        cw.merge({"recording": ["a"], "t_s": [0.0]}, rest_until_s=0.0)
    with pytest.raises(cw.ChainwaveError, match="a number from 1, found 0"):
        cw.merge({"recording": ["a"], "body": [0], "t_s": [0.0], "x_m": [0.0], "sigma_m": [1e-6]}, rest_until_s=0.0)
    with pytest.raises(cw.ChainwaveError, match="beside m_per_px"):
        cw.merge({"recording": ["a"]}, rest_until_s=0.0, m_per_px=1e-4)
    with pytest.raises(cw.ChainwaveError, match="dict of columns"):
        cw.merge(3, rest_until_s=0.0)


@pytest.mark.parametrize("script", sorted(NOTEBOOKS.glob("*.py")), ids=lambda path: path.stem)
def test_notebooks_run(script: Path, tmp_path: Path) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "CHAINWAVE_EXPERIMENT"}
    ended = subprocess.run([sys.executable, script], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
