"""Tables as other libraries take them, and strain as a map."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import chainwave as cw
import numpy as np
import pytest


@pytest.fixture(scope="module")
def tracks(frames: Any) -> cw.Tracks:
    """A point that is found, and one that is out of view: numbers, counts and texts, some of them lost."""
    names = {"name": ["in", "out"], "x_px": [40.0, 1.0], "y_px": [40.0, 1.0]}
    with pytest.warns(cw.ChainwaveWarning, match="reaches outside"):
        return cw.track(cw.Recording.from_array(frames, rate_hz=1e4), {**names, "half_width_px": [12, 12], "half_height_px": [12, 12]})


def test_numpy_takes_columns(tracks: cw.Tracks) -> None:
    assert set(tracks.to_dict()) == set(tracks.columns) == set(tracks) and "x_px" in tracks
    assert tracks["x_px"].shape == (16,) and np.isnan(tracks["x_px"]).sum() == 8
    assert tracks["frame"].dtype == np.uint32
    with pytest.raises(KeyError, match="nothing"):
        tracks["nothing"]


def test_pyarrow_takes_tables_without_a_copy(tracks: cw.Tracks) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    table, again = pyarrow.table(tracks), pyarrow.table(tracks)
    assert table.num_rows == len(tracks) and table.column_names == tracks.columns
    assert pyarrow.schema(tracks) == table.schema and table["x_px"].null_count == 8
    assert np.array_equal(table["t_s"].to_numpy(), tracks["t_s"])
    # Both show the same memory.
    addresses = [one["x_px"].chunk(0).buffers()[1].address for one in (table, again)]
    assert addresses[0] == addresses[1]


def test_polars_takes_tables(tracks: cw.Tracks) -> None:
    polars = pytest.importorskip("polars")
    table = polars.DataFrame(tracks)
    assert table.columns == tracks.columns and table["x_px"].null_count() == 8
    assert table["frame"].to_list() == tracks["frame"].tolist() and table["name"].to_list() == tracks["name"].tolist()


def test_pandas_takes_tables(tracks: cw.Tracks) -> None:
    pandas = pytest.importorskip("pandas", minversion="3.0")
    table = pandas.DataFrame.from_arrow(tracks)
    assert list(table.columns) == tracks.columns and table["x_px"].isna().sum() == 8
    assert table["name"].tolist() == tracks["name"].tolist()
    assert np.array_equal(table["t_s"].to_numpy(), tracks["t_s"])


def test_duckdb_takes_tables(tracks: cw.Tracks) -> None:
    duckdb = pytest.importorskip("duckdb")
    with duckdb.connect() as database:
        database.register("tracks", tracks)
        found = database.sql("select name, count(x_px), max(frame) from tracks group by name order by name").fetchall()
    assert found == [("in", 8, 7), ("out", 0, 7)]


def test_notebooks_see_the_first_rows(tracks: cw.Tracks) -> None:
    assert "16 rows" in repr(tracks) and "<table>" in tracks._repr_html_() and "the first 8" in tracks._repr_html_()


def strain() -> cw.StrainMap:
    """Three bodies, of which the last is lost at the last time."""
    body, t_s = np.meshgrid([1, 2, 3], np.arange(8) * 1e-5, indexing="ij")
    x_m = np.where((body == 1) & (t_s > 0), 3e-5, 0.0)
    x_m[2, 7] = np.nan
    return cw.strain_map({"t_s": t_s.ravel(), "body": body.ravel(), "x_m": x_m.ravel()}, pitch_m=0.03)


STRAIN = np.array([[0.0] + 7 * [-1e-3], 7 * [0.0] + [np.nan]])


def test_strain_is_a_map() -> None:
    found = strain()
    assert found.gaps.tolist() == [1, 2] and np.allclose(found.times_s, np.arange(8) * 1e-5)
    assert np.allclose(found.grid(), STRAIN, rtol=0.0, atol=1e-12, equal_nan=True)
    assert np.allclose(found.grid("sigma"), 0.0 * STRAIN, equal_nan=True)


def test_strain_is_drawn_where_matplotlib_is() -> None:
    pytest.importorskip("matplotlib").use("agg")
    axes = strain().plot(cmap="gray")
    drawn = axes.collections[0].get_array()
    # Compression is drawn upwards, in percent; what is not known stays empty.
    assert np.allclose(np.ma.filled(drawn, np.nan), -100.0 * STRAIN, rtol=0.0, atol=1e-9, equal_nan=True)
    assert axes.get_xlabel() == "time after the trigger (ms)" and axes.collections[0].get_cmap().name == "gray"
    assert strain().plot(axes) is axes


def test_matplotlib_is_imported_by_plots_alone() -> None:
    program = (
        "import sys, chainwave as cw; "
        "times_s = [1e-5 * k for k in range(8)]; "
        "cw.strain_map({'t_s': times_s * 2, 'body': [1] * 8 + [2] * 8, 'x_m': [0.0] * 16}, pitch_m=1.0).grid(); "
        "print('matplotlib' in sys.modules)"
    )
    ended = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    assert ended.stdout == "False\n"


def test_figures_are_svg_and_numbers(tmp_path: Path) -> None:
    body, t_s = np.meshgrid(np.arange(1, 13), np.arange(0, 400) * 1e-5, indexing="ij")
    x_m = 1e-3 * (1.0 + np.tanh((t_s - 0.03 * (body - 1) / 200.0 - 1e-3) / 2e-4))
    measured = cw.measure({"t_s": t_s.ravel(), "body": body.ravel(), "x_m": x_m.ravel()}, pitch_m=0.03)
    assert set(measured.figures) == {"displacements", "strain-map"}
    for figure in measured.figures.values():
        assert ElementTree.fromstring(figure.svg).tag.endswith("svg") and figure._repr_svg_() == figure.svg
    measured.figures["strain-map"].save(tmp_path / "map.svg")
    assert (tmp_path / "map.svg").read_text(encoding="utf-8") == measured.figures["strain-map"].svg
    shown = measured.figures["strain-map"].data[0]
    # Compression in percent over gap and time in milliseconds, as it is drawn: cells may stand for several samples.
    assert "gap" in shown.x and "ms" in shown.y and "%" in shown.colour and len(shown.table) % 11 == 0
    peak = -100.0 * measured.strain["strain"].min()
    assert 0.9 * peak < np.nanmax(shown.table["colour"]) < 1.0001 * peak
    assert len(measured.figures["displacements"].data) == 5 and "<svg" in measured._repr_html_()
