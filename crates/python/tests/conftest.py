"""What the tests share: small recordings whose truth is known."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

REPOSITORY = Path(__file__).parents[3]
SHIFT_PX = 0.37


def speckle(x_px: Any, y_px: Any) -> Any:
    """A texture of forty waves in closed form, around 2000 counts."""
    waves = np.arange(1, 41)
    kx, ky, phase = 0.9 * np.sin(waves), 0.9 * np.sin(2 * waves + 1), waves**2
    return 2000.0 + 150.0 * np.sin(
        kx * np.asarray(x_px)[..., None] + ky * np.asarray(y_px)[..., None] + phase
    ).sum(axis=-1)


def film(n_frames: int = 8, width: int = 96, height: int = 80) -> Any:
    """Frames of the texture, each SHIFT_PX further to the right than the one before, as whole counts of 12 bits."""
    y, x = np.mgrid[:height, :width].astype(float)
    frames = [speckle(x - SHIFT_PX * k, y) for k in range(n_frames)]
    return np.clip(np.rint(frames), 0, 4095).astype(np.uint16)


@pytest.fixture(scope="session")
def frames() -> Any:
    """Frames as an array."""
    return film()


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory, frames: Any) -> Path:
    """The same in a file."""
    path = tmp_path_factory.mktemp("recording") / "film.npy"
    np.save(path, frames)
    return path


@pytest.fixture(scope="session")
def points(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two points with sizes, and one whose size is left open."""
    path = tmp_path_factory.mktemp("points") / "points.csv"
    path.write_text("name,x_px,y_px,half_width_px,half_height_px\na,30,40,12,12\nb,60,40,10,14\nc,45,25,,\n")
    return path


@pytest.fixture(scope="session")
def command() -> str:
    """The command that came with the wheel, or the one that the environment names."""
    found = os.environ.get("CHAINWAVE_COMMAND") or shutil.which("chainwave", path=str(Path(sys.executable).parent))
    if not found:
        pytest.skip("there is no command beside this Python, and CHAINWAVE_COMMAND names none")
    return found


@pytest.fixture(scope="session")
def filmed(tmp_path_factory: pytest.TempPathFactory, command: str) -> Path:
    """The small experiment, filmed."""
    folder = tmp_path_factory.mktemp("filmed")
    small = REPOSITORY / "tests" / "small-experiment" / "experiment.toml"
    subprocess.run([command, "synthesize", small, "--out", folder, "--jobs", "2"], check=True)
    return folder
