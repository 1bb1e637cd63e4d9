"""Simulated motions and contact laws."""

from __future__ import annotations

import json
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import chainwave as cw
import numpy as np
import polars
import pytest
from polars.testing import assert_frame_equal

SCENE: dict[str, Any] = {
    "model": "chain",
    "n_bodies": 8,
    "duration_s": 2e-3,
    "output_interval_s": 1e-5,
    "body": {"mass_kg": 0.455e-3, "pitch_m": 0.030, "damping_kg_per_s": 0.003},
    "contact": {"law": "power", "a": 60.1, "delta_0_m": 2.27e-3, "p": 0.114},
    "drive": {"kind": "striker", "mass_kg": 4.3e-3, "velocity_m_per_s": 2.73, "damping_kg_per_s": 0.2},
}


def curve() -> dict[str, Any]:
    """A compression curve of the paper's law, with the noise of a load cell."""
    overlap_m = np.linspace(0.0, 4e-3, 120)
    force_n = 60.1 * (overlap_m + 2.27e-3) ** 0.114 - 60.1 * 2.27e-3**0.114
    return {"overlap_m": overlap_m, "force_n": force_n + np.random.default_rng(3).normal(0.0, 5e-3, 120)}


def test_a_motion_has_the_bits_of_the_command(command: str, tmp_path: Path) -> None:
    from chainwave._toml import toml_of

    scene, out, summary = tmp_path / "scene.toml", tmp_path / "motion.parquet", tmp_path / "summary.json"
    scene.write_text(toml_of(SCENE))
    subprocess.run([command, "simulate", scene, "--out", out, "--summary", summary], check=True)
    expected = json.loads(summary.read_text())
    for of_scene in (scene, SCENE, {**SCENE, "body": {**SCENE["body"], "mass_kg": np.full(8, 0.455e-3)}}):
        motion = cw.simulate(of_scene)
        assert_frame_equal(polars.DataFrame(motion), polars.read_parquet(out), check_exact=True)
        assert {**motion.summary, "wall_s": 0.0} == {**expected, "wall_s": 0.0}


def test_momentum_goes_from_the_striker_to_the_chain() -> None:
    undamped = {**SCENE, "body": {**SCENE["body"], "damping_kg_per_s": 0.0}, "drive": {**SCENE["drive"], "damping_kg_per_s": 0.0}}
    table = polars.DataFrame(cw.simulate(undamped))
    mass_kg = polars.when(polars.col("body") == 0).then(4.3e-3).otherwise(0.455e-3)
    momentum = table.group_by("t_s").agg((mass_kg * polars.col("v_m_per_s")).sum().alias("p"))["p"].to_numpy()
    # Forces between bodies are pairs; the integrator's accuracy is 1e-6 of the displacement.
    assert np.abs(momentum / (4.3e-3 * 2.73) - 1.0).max() < 1e-4


def test_wrong_scenes_are_named(tmp_path: Path) -> None:
    with pytest.raises(cw.ChainwaveError, match="unknown field `n_body`"):
        cw.simulate({**SCENE, "n_body": 3})
    with pytest.raises(FileNotFoundError, match="nowhere.toml"):
        cw.simulate(tmp_path / "nowhere.toml")


def test_a_contact_law_is_found_again(command: str, tmp_path: Path) -> None:
    law = cw.fit_contact(curve())
    for name, truth in (("a", 60.1), ("delta_0_m", 2.27e-3), ("p", 0.114)):
        estimate = getattr(law, name)
        assert abs(estimate.value - truth) < 4 * estimate.sigma, (name, estimate)
        low, high = estimate.interval95
        assert low < estimate.value < high
    polars.DataFrame(curve()).write_csv(tmp_path / "curve.csv")
    subprocess.run([command, "contact", tmp_path / "curve.csv", "--out", tmp_path / "law.toml"], check=True)
    expected = tomllib.loads((tmp_path / "law.toml").read_text())
    of_file = cw.fit_contact(tmp_path / "curve.csv")
    for name in ("a", "delta_0_m", "p", "f_0_n", "k_0_n_per_m"):
        assert (getattr(of_file, name).value, getattr(of_file, name).sigma) == (expected[name], expected[f"{name}_sigma"])
    assert cw.simulate({**SCENE, "contact": law.as_contact()}).summary["tension_events"] == 0


def test_wrong_curves_are_named() -> None:
    with pytest.raises(cw.ChainwaveError, match="column named force_n"):
        cw.fit_contact({"overlap_m": [0.0, 1.0]})
    with pytest.raises(cw.ChainwaveError, match="expected auto"):
        cw.fit_contact(curve(), zero="here")


def test_a_dict_is_what_a_file_with_its_numbers_is(tmp_path: Path) -> None:
    mass_kg = 0.00045524741119095237
    scene: dict[str, Any] = {
        "model": "chain",
        "n_bodies": 4,
        "duration_s": 2e-3,
        "output_interval_s": 1e-4,
        "body": {"pitch_m": 0.03, "mass_kg": mass_kg, "damping_kg_per_s": 1.0 / 3000.0},
        "contact": {"law": "power", "a": 60.1, "delta_0_m": 2.27e-3, "p": 0.114},
        "drive": {"kind": "striker", "mass_kg": 4.3e-3, "velocity_m_per_s": 2.73, "damping_kg_per_s": 0.1},
    }
    lines = [f"{key} = {value!r}" for key, value in scene.items() if not isinstance(value, dict)]
    for name, table in scene.items():
        if isinstance(table, dict):
            lines += [f"[{name}]", *(f"{key} = " + (f'"{value}"' if isinstance(value, str) else repr(value)) for key, value in table.items())]
    path = tmp_path / "scene.toml"
    path.write_text("\n".join(lines) + "\n")
    by_dict, by_file = cw.simulate(scene), cw.simulate(path)
    assert np.array_equal(by_dict["x_m"], by_file["x_m"])
