"""Others' formats: results that MATLAB and others read, and tracks that other programs wrote."""

from __future__ import annotations

import json
import pickle
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import polars
import pytest

N_BODIES, N_FRAMES = 8, 1000
PITCH_PX, PX_PER_S, RATE_HZ, M_PER_PX = 60.0, 3000.0, 4000.0, 1e-3
SPEED_M_PER_S = PX_PER_S * M_PER_PX


@pytest.fixture(scope="module")
def places() -> Any:
    """Places of bodies in pixels, shape (frames, bodies, 2): smooth steps to the right that run through the chain, each a pitch away."""
    t_s, body = np.meshgrid(np.arange(N_FRAMES) / RATE_HZ, np.arange(N_BODIES), indexing="ij")
    step_px = 2.5 * (1.0 + np.tanh((t_s - 0.05 - body * PITCH_PX / PX_PER_S) / 6e-3))
    return np.stack([100.0 + PITCH_PX * body + step_px, 40.0 + 0.0 * body], axis=-1)


def trackpy(folder: Path, places: Any) -> Path:
    """A table of trajectories as pandas writes it, its particles numbered in an order of their own, one of them dust."""
    pandas = pytest.importorskip("pandas")
    frame, body = np.meshgrid(np.arange(N_FRAMES), np.arange(N_BODIES), indexing="ij")
    columns = {"y": places[..., 1], "x": places[..., 0], "mass": 0.0 * body + 711.5, "ep": 0.0 * body + 1e-3, "frame": frame}
    table = pandas.DataFrame({**{name: values.ravel() for name, values in columns.items()}, "particle": (5 * body % 8).ravel()})
    table = table.drop(index=[17, 905])
    dust = pandas.DataFrame({"y": [9.0], "x": [3.0], "mass": [55.0], "ep": [np.nan], "frame": [11], "particle": [30]})
    pandas.concat([table, dust], ignore_index=True).to_csv(folder / "tracks.csv")
    return folder / "tracks.csv"


def trackpy_filtered(folder: Path, places: Any) -> Path:
    """The same after stubs were filtered out: frames are the index too, under the same name."""
    pandas = pytest.importorskip("pandas")
    table = pandas.read_csv(trackpy(folder, places), index_col=0)
    table.set_index("frame", drop=False).to_csv(folder / "tracks.csv")
    return folder / "tracks.csv"


def dltdv(folder: Path, places: Any) -> Path:
    """Points of a camera, y upwards, a row for each frame; some were not digitised."""
    names = [f"pt{point}_cam1_{axis}" for point in range(1, N_BODIES + 1) for axis in "XY"]
    cells = np.where(np.arange(N_FRAMES)[:, None, None] == 7, np.nan, places).reshape(N_FRAMES, -1)
    np.savetxt(folder / "xypts.csv", cells, fmt="%.6f", delimiter=",", header=",".join(names), comments="")
    text = (folder / "xypts.csv").read_text().replace("nan", "NaN")
    (folder / "xypts.csv").write_text(text)
    return folder / "xypts.csv"


def dltdv_sparse(folder: Path, places: Any) -> Path:
    """The same, column after column, as entries of a sparse matrix."""
    cells = places.reshape(N_FRAMES, -1)
    lines = [f"{row + 1}\t{column + 1}\t{cells[row, column]:.6f}" for column in range(cells.shape[1]) for row in range(N_FRAMES)]
    head = ["Sparse format camera coordinates file", f"{N_FRAMES}\t{cells.shape[1]}\t{cells.size}"]
    (folder / "xypts.tsv").write_text("\n".join([*head, *lines]) + "\n")
    return folder / "xypts.tsv"


def tracker(folder: Path, places: Any) -> Path:
    """Several point masses with decimal commas, lengths in the calibration's unit, times in seconds, a cell not marked."""

    def number(value: float) -> str:
        return f"{value:.9E}".replace(".", ",").replace("E+0", "E").replace("E-0", "E-")

    lines = ["#multi:", "\t" + "".join(f"mass {chr(65 + body)}\t\t" for body in range(N_BODIES)), "t\t" + "x\ty\t" * N_BODIES]
    for frame in range(N_FRAMES):
        cells = ["" if frame == 5 else number(value) for value in places[frame].ravel()]
        lines.append("\t".join([number(frame / RATE_HZ), *cells]))
    (folder / "tracker.txt").write_text("\r\n".join(lines) + "\r\n")
    return folder / "tracker.txt"


def pyidi(folder: Path, places: Any, protocol: int = -1) -> Path:
    """Displacements of points, y first, and beside them the points, in an order of their own."""
    order = [3, 1, 0, 2, 7, 6, 5, 4]
    found = np.swapaxes(places - places[0], 0, 1)[order][..., ::-1]
    (folder / "results.pkl").write_bytes(pickle.dumps(np.ascontiguousarray(found), protocol=protocol))
    (folder / "points.pkl").write_bytes(pickle.dumps(np.rint(places[0][order])[:, ::-1].astype(int), protocol=protocol))
    return folder / "results.pkl"


def pyidi_old(folder: Path, places: Any) -> Path:
    """The same by an older way of pickling."""
    return pyidi(folder, places, protocol=2 + 1)


def pyidi_fortran(folder: Path, places: Any) -> Path:
    """Displacements in the order of the body, saved by NumPy, first index fastest; without places."""
    np.save(folder / "results.npy", np.asfortranarray(np.swapaxes(places - places[0], 0, 1)[..., ::-1]))
    return folder / "results.npy"


def tracking_markers(folder: Path, places: Any) -> Path:
    """The history of markers, y upwards."""
    np.save(folder / "markers.npy", places)
    return folder / "markers.npy"


PROGRAMS: list[tuple[str, Callable[[Path, Any], Path]]] = [
    ("trackpy", trackpy),
    ("trackpy", trackpy_filtered),
    ("dltdv", dltdv),
    ("dltdv", dltdv_sparse),
    ("tracker", tracker),
    ("pyidi", pyidi),
    ("pyidi", pyidi_old),
    ("pyidi", pyidi_fortran),
    ("tracking-markers", tracking_markers),
]


def mapping(path: Path, program: str, more: str = "") -> Path:
    """A mapping for a file of a program."""
    time = "" if program == "tracker" else f"rate_hz = {RATE_HZ}"
    text = f"""
        name = "steps"
        program = "{program}"
        trials = ["{path.name}"]
        {more}
        [chain]
        n_bodies = {N_BODIES}
        pitch_m = {PITCH_PX * M_PER_PX}
        [time]
        {time}
        rest_until_s = 0.005
        [displacement]
        unit_m = {M_PER_PX}
        [sigma]
        usual_m = 1e-8
    """
    written = path.with_name("mapping.toml")
    written.write_text(text)
    return written


@pytest.mark.parametrize(("program", "write"), PROGRAMS, ids=[write.__name__ for _, write in PROGRAMS])
def test_tracks_of_other_programs_are_imported(
    program: str, write: Callable[[Path, Any], Path], places: Any, command: str, tmp_path: Path
) -> None:
    # The dust of trackpy is no body: the others are named.
    named = f"tracks = {[str(5 * body % 8) for body in range(N_BODIES)]}" if program == "trackpy" else ""
    asked = mapping(write(tmp_path, places), program, named)
    subprocess.run([command, "import", asked, "--out", tmp_path / "out"], check=True, capture_output=True)
    motion = polars.read_parquet(tmp_path / "out" / "motion.parquet").filter(polars.col("x_m").is_not_null())
    frame, row = np.rint(motion["t_s"].to_numpy() * RATE_HZ).astype(int), motion["body"].to_numpy() - 1
    # The one trial's own clock: frames are those of the file.
    moved_m = M_PER_PX * (places[frame, row, 0] - places[0, row, 0])
    # Half a step of the last of six digits in a place and in the mean of places at rest, and what the step's foot has moved by then.
    foot_px = 2.5 * (1.0 + np.tanh((0.005 - 0.05) / 6e-3))
    assert np.abs(motion["x_m"].to_numpy() - moved_m).max() < (1e-6 + foot_px) * M_PER_PX and set(row) == set(range(N_BODIES))
    results = json.loads((tmp_path / "out" / "results.json").read_text())
    # Sampling finds the peak of a pulse that is 24 frames wide to a hundredth of a frame, over 6 gaps of 80 frames.
    assert results["group_velocity_m_per_s"] == pytest.approx(SPEED_M_PER_S, rel=1e-3)
    if program == "trackpy":
        assert motion["sigma_m"].min() > 0.9e-3 * M_PER_PX / np.sqrt(2)


def test_wrong_files_of_other_programs_are_named(places: Any, command: str, tmp_path: Path) -> None:
    def refused(program: str, path: Path, more: str = "") -> str:
        asked = mapping(path, program, more)
        ended = subprocess.run([command, "import", asked, "--out", tmp_path / "out"], capture_output=True, text=True)
        assert ended.returncode == 2, ended.stderr
        return ended.stderr

    assert "8 of them (hint: tracks" in refused("trackpy", trackpy(tmp_path, places))
    assert 'one named "9"' in refused("dltdv", dltdv(tmp_path, places), 'tracks = ["9"]')
    assert "unknown variant" in refused("blender", tmp_path / "tracks.csv")
    assert "pt1_cam1_X" in refused("dltdv", tmp_path / "tracks.csv")
    assert "a line of columns t, x, y" in refused("tracker", tmp_path / "xypts.csv")
    np.save(tmp_path / "flat.npy", places[0])
    assert "(frames, markers, 2)" in refused("tracking-markers", tmp_path / "flat.npy")
    assert "either program" in refused("dltdv", tmp_path / "xypts.csv", "[layout]\nseparator = 'comma'\nbodies = 'lines'")


class Harm:
    """What runs when an unwary reader unpickles it."""

    def __reduce__(self) -> Any:
        return Path.touch, (Path("harm"),)


def test_pickles_are_read_and_never_run(places: Any, command: str, tmp_path: Path) -> None:
    whole = pyidi(tmp_path, places).read_bytes()
    path = tmp_path / "bad.pkl"
    cut = [whole[:n] for n in (0, 1, 20, 100, len(whole) // 2, len(whole) - 1)]
    for held in (pickle.dumps(Harm()), pickle.dumps([1, 2]), pickle.dumps(np.array(["a"])), *cut):
        path.write_bytes(held)
        ended = subprocess.run(
            [command, "import", mapping(path, "pyidi"), "--out", tmp_path / "out"], capture_output=True, text=True, cwd=tmp_path
        )
        assert ended.returncode == 2 and "an array of numbers as NumPy pickles it" in ended.stderr, ended.stderr
    assert not (tmp_path / "harm").exists()


@pytest.fixture(scope="module")
def results(places: Any, command: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results with tables that have numbers, counts and texts."""
    folder = tmp_path_factory.mktemp("results")
    asked = mapping(dltdv(folder, places), "dltdv")
    subprocess.run([command, "import", asked, "--out", folder / "out"], check=True, capture_output=True)
    return folder / "out"


def test_results_are_written_for_matlab(results: Path, command: str, tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    subprocess.run([command, "export", results, "--out", tmp_path / "all.mat"], check=True, capture_output=True)
    subprocess.run([command, "export", results / "front.parquet", "--out", tmp_path / "front.mat"], check=True, capture_output=True)
    found = io.loadmat(tmp_path / "all.mat", simplify_cells=True, chars_as_strings=True)
    tables = {path.stem: polars.read_parquet(path) for path in results.glob("*.parquet")}
    assert len(tables) >= 5 and {name for name in found if not name.startswith("__")} == {*tables, "results"}
    for name, table in tables.items():
        for column in table.columns:
            values = np.atleast_1d(found[name][column])
            if table[column].dtype == polars.String:
                assert [str(value) if np.size(value) else "" for value in values] == table[column].to_list()
            else:
                expected = table[column].cast(polars.Float64).fill_null(np.nan).to_numpy()
                assert np.array_equal(values, expected, equal_nan=True), (name, column)
    assert found["strain"]["gap"].dtype == np.uint32
    assert found["results"]["group_velocity_m_per_s"] == json.loads((results / "results.json").read_text())["group_velocity_m_per_s"]
    alone = io.loadmat(tmp_path / "front.mat", simplify_cells=True)
    assert np.array_equal(alone["front"]["t_peak_s"], found["front"]["t_peak_s"], equal_nan=True)


def test_results_are_written_as_csv(results: Path, command: str, tmp_path: Path) -> None:
    subprocess.run([command, "export", results, "--out", tmp_path / "tables"], check=True, capture_output=True)
    strain = polars.read_csv(tmp_path / "tables" / "strain.csv")
    assert np.array_equal(strain["strain"], polars.read_parquet(results / "strain.parquet")["strain"])
    subprocess.run([command, "export", tmp_path / "tables" / "strain.csv", "--out", tmp_path / "s.parquet"], check=True, capture_output=True)
    assert polars.read_parquet(tmp_path / "s.parquet")["strain"].equals(strain["strain"])


def test_parquet_is_packed_as_matlab_reads_it(results: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    for path in results.glob("*.parquet"):
        told = parquet.ParquetFile(path).metadata.row_group(0)
        assert {told.column(at).compression for at in range(told.num_columns)} == {"SNAPPY"}
