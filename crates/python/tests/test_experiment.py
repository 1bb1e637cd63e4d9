"""An experiment as a whole: the same bits as the command's, and as a dict."""

from __future__ import annotations

import json
import subprocess
import tomllib
import warnings
from pathlib import Path
from typing import Any

import chainwave as cw
import polars
import pytest
from polars.testing import assert_frame_equal

TABLES = ["tracks", "motion", "strain", "front", "hwhm", "energy", "spectrum"]


def run(experiment: Any, **options: Any) -> cw.Results:
    """Runs it, whatever it warns of."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cw.ChainwaveWarning)
        return cw.Experiment(experiment, **options).run()


def test_results_have_the_bits_of_the_command(filmed: Path, command: str, tmp_path: Path) -> None:
    experiment = filmed / "experiment.toml"
    subprocess.run([command, "run", experiment, "--out", tmp_path], check=True, capture_output=True)
    told: list[tuple[str, int, int]] = []
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        results = cw.Experiment(experiment).run(progress=lambda *news: told.append(news))
    for name in TABLES:
        expected = polars.read_parquet(tmp_path / f"{name}.parquet")
        assert_frame_equal(polars.DataFrame(getattr(results, name)), expected, check_exact=True)
    expected = json.loads((tmp_path / "results.json").read_text())
    for name, sigma in (
        ("group_velocity_m_per_s", "group_velocity_sigma"),
        ("c_d_kg_per_s", "c_d_sigma"),
        ("c_s_kg_per_s", "c_s_sigma"),
        ("local_resonance_hz", "local_resonance_sigma"),
    ):
        estimate: cw.Estimate = getattr(results, name)
        assert (estimate.value, estimate.sigma) == (expected.get(name), expected.get(sigma))
        assert estimate.refused == expected.get(f"{name}_refused")
        if estimate.interval95 is not None:
            assert estimate.interval95[0] < float(estimate) < estimate.interval95[1]
    assert [one._asdict() for one in results.warnings] == expected["warnings"]
    assert [one._asdict() for one in results.recordings] == expected["recordings"]
    assert results.decisions == json.loads((tmp_path / "decisions.json").read_text())
    said = [str(one.message) for one in warned if one.category is cw.ChainwaveWarning]
    assert all(str(finding) in said for finding in results.warnings)
    assert told[-1][0] == "tracking" and told[-1][1] == told[-1][2] > 0
    assert "group_velocity_m_per_s" in results._repr_html_() and "Results" in repr(results)


def test_a_dict_is_an_experiment(filmed: Path) -> None:
    tables = tomllib.loads((filmed / "experiment.toml").read_text())
    tables["trials"] = polars.read_csv(filmed / tables["trials"])
    of_dict, of_file = run(tables, recordings=filmed), run(filmed / "experiment.toml")
    assert_frame_equal(polars.DataFrame(of_dict.motion), polars.DataFrame(of_file.motion), check_exact=True)
    assert of_dict.c_d_kg_per_s == of_file.c_d_kg_per_s
    assert len(cw.Experiment(tables, recordings=filmed).recordings) == len(tables["trials"])


def test_an_experiment_needs_no_files(filmed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tables = tomllib.loads((filmed / "experiment.toml").read_text())
    tables["trials"] = polars.read_csv(filmed / tables["trials"])
    opened = {name: cw.open(filmed / name) for name in tables["trials"]["recording"]}

    def in_memory(name: str, recording: cw.Recording) -> cw.Recording:
        return cw.Recording.from_array(
            recording[:], times_s=recording.times_s, rate_hz=recording.rate_hz, bit_depth=recording.bit_depth, name=name
        )

    held = {name: in_memory(name, recording) for name, recording in opened.items()}
    of_files = run(tables, recordings=filmed)
    monkeypatch.chdir(tmp_path)
    of_arrays = run(tables, recordings=held)
    assert_frame_equal(polars.DataFrame(of_arrays.tracks), polars.DataFrame(of_files.tracks), check_exact=True)
    assert_frame_equal(polars.DataFrame(of_arrays.motion), polars.DataFrame(of_files.motion), check_exact=True)
    assert of_arrays.c_d_kg_per_s == of_files.c_d_kg_per_s

    first = tables["trials"]["recording"][0]
    with pytest.raises(cw.ChainwaveError, match="expected names that the trials table has"):
        cw.Experiment(tables, recordings={"another.cine": opened[first]})
    tables["camera"].pop("rate_hz", None)
    with pytest.raises(cw.ChainwaveError, match="expected times, found an array alone"):
        cw.Experiment(tables, recordings={first: opened[first][:]})
    tables["camera"]["rate_hz"] = opened[first].rate_hz
    assert cw.Experiment(tables, recordings={first: opened[first][:]}).recordings[0] == first


def test_an_interrupted_run_goes_on(filmed: Path) -> None:
    experiment = cw.Experiment(filmed / "experiment.toml")

    class Enough(Exception):
        """Ends the work."""

    def stop(stage: str, done: int, planned: int) -> None:
        raise Enough

    with pytest.raises(Enough):
        experiment.run(progress=stop)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cw.ChainwaveWarning)
        assert len(experiment.run().motion) > 0


def test_a_velocity_that_fails_does_not_take_the_others_along(filmed: Path) -> None:
    tables = tomllib.loads((filmed / "experiment.toml").read_text())
    trials = polars.read_csv(filmed / tables["trials"])
    good = trials.with_columns(polars.lit(2.73).alias("striker_velocity_m_per_s"))
    lost = trials.with_columns(
        polars.concat_str(polars.lit("lost_"), polars.col("recording")).alias("recording"),
        polars.lit(0.83).alias("striker_velocity_m_per_s"),
    )
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always", cw.ChainwaveWarning)
        found = cw.Experiment({**tables, "trials": polars.concat([good, lost])}, recordings=filmed).run_all()
    # Each result has the velocity as fitted, within the strikes' scatter of the stated one; the other is far off.
    assert [round(one.striker_velocity_m_per_s.value, 1) for one in found] == [2.7]
    assert any(str(one.message).startswith("striker 0.83 m/s: ") for one in warned)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cw.ChainwaveWarning)
        with pytest.raises(cw.ChainwaveError, match="recordings"):
            cw.Experiment({**tables, "trials": lost}, recordings=filmed).run_all()


def test_wrong_experiments_are_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="experiment.toml"):
        cw.Experiment(tmp_path / "experiment.toml")
    (tmp_path / "experiment.toml").write_text('name = "a"\n')
    with pytest.raises(cw.ChainwaveError, match="missing field"):
        cw.Experiment(tmp_path / "experiment.toml")
    with pytest.raises(cw.ChainwaveError, match="missing field"):
        cw.Experiment({"name": "a", "trials": "trials.csv"})
