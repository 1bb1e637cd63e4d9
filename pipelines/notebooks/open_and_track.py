"""Open a recording, follow two points, and see how well they are known."""

# %% A film of a texture that moves to the right by 0.2 px a frame, written as an .npy stack
import tempfile
from pathlib import Path

import chainwave as cw
import numpy as np

STEP_PX = 0.2
wave = np.arange(1, 41)
kx, ky, phase = 0.9 * np.sin(wave), 0.9 * np.sin(2 * wave + 1), wave**2
rows, columns = np.mgrid[:80, :120].astype(float)


def frame(moved_px: float) -> np.ndarray:
    """Counts of 12 bits."""
    angle = kx * (columns - moved_px)[..., None] + ky * rows[..., None] + phase
    return np.rint(2000 + 150 * np.sin(angle).sum(axis=-1)).clip(0, 4095).astype(np.uint16)


path = Path(tempfile.mkdtemp()) / "film.npy"
np.save(path, np.stack([frame(STEP_PX * k) for k in range(12)]))

# %% The recording: nothing but the header is read until a frame is asked for
recording = cw.open(path, rate_hz=100e3)
print(recording)
print(recording[0].dtype, recording[0].shape, recording[3, 10:20, 30:40].mean())

# %% Two points; the half sizes of the second are left to the picture
points = [
    {"name": "left", "x_px": 40, "y_px": 40, "half_width_px": 14, "half_height_px": 14},
    {"name": "right", "x_px": 75, "y_px": 40},
]
tracks = cw.track(recording, points)
print(tracks)
for subset in tracks.subsets:
    print(subset)

# %% Columns are NumPy arrays; the whole table goes to polars, pandas or pyarrow as it is
left = tracks["name"] == "left"
moved_px = tracks["x_px"][left] - 40
print("moved", moved_px.round(4), "+-", tracks["sigma_x_px"][left].max().round(5))
assert np.abs(moved_px - STEP_PX * np.arange(12)).max() < 0.02
