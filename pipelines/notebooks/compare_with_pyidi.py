"""The same points followed by chainwave and by pyIDI (pip install pyidi), both against a motion that is known."""

# %% A film of a texture that swings to and fro by a third of a pixel, as counts of 12 bits with noise
import tempfile

import chainwave as cw
import numpy as np

N_FRAMES, RATE_HZ, AMPLITUDE_PX, NOISE_COUNTS = 40, 1e4, 0.33, 4.0
wave = np.arange(1, 41)
kx, ky, phase = 0.9 * np.sin(wave), 0.9 * np.sin(2 * wave + 1), wave**2
rows, columns = np.mgrid[:80, :120].astype(float)
truth_px = AMPLITUDE_PX * np.sin(2 * np.pi * np.arange(N_FRAMES) / 20)
drawn = np.random.default_rng(1)


def frame(x_px: float) -> np.ndarray:
    """The texture moved to the right."""
    angle = kx * (columns - x_px)[..., None] + ky * rows[..., None] + phase
    counts = 2000 + 150 * np.sin(angle).sum(axis=-1) + drawn.normal(0.0, NOISE_COUNTS, rows.shape)
    return np.rint(counts).clip(0, 4095).astype(np.uint16)


film = np.array([frame(x_px) for x_px in truth_px])
places = np.array([(30, 40), (60, 40), (90, 40)])

# %% Ours, with its own statement of how far off it may be
points = [{"name": str(n), "x_px": x, "y_px": y, "half_width_px": 10, "half_height_px": 10} for n, (x, y) in enumerate(places)]
recording = cw.Recording.from_array(film, rate_hz=RATE_HZ, bit_depth=12)
tracks = cw.track(recording, points)
moved_px = tracks["x_px"] - places[tracks["name"].astype(int), 0]
error_px = moved_px - truth_px[tracks["frame"]]
print(f"chainwave: rms error {np.sqrt(np.mean(error_px**2)):.4f} px, stated {np.sqrt(np.mean(tracks['sigma_x_px'] ** 2)):.4f} px")
# All errors share that of the reference frame, so that their mean square is told by few: three times its root is rare.
assert np.sqrt(np.mean(error_px**2)) < 3 * np.sqrt(np.mean(tracks["sigma_x_px"] ** 2))

# %% The other's, where it is installed: the same points and sizes, displacements of shape (points, frames, 2), y first
try:
    import pyidi
except ImportError:
    print("pyIDI is not installed: nothing to compare with")
else:
    with tempfile.TemporaryDirectory() as folder:
        method = pyidi.LucasKanade(pyidi.VideoReader(film, root=folder, fps=RATE_HZ))
        method.set_points(places[:, ::-1])
        method.configure(roi_size=(21, 21), verbose=0, show_pbar=False)
        theirs_px = method.get_displacements(autosave=False)[..., 1]
    their_error_px = theirs_px - truth_px
    print(f"pyIDI:     rms error {np.sqrt(np.mean(their_error_px**2)):.4f} px, which it does not state")
    apart_px = np.abs(moved_px.reshape(len(places), N_FRAMES) - theirs_px).max()
    print(f"farthest apart: {apart_px:.4f} px")
    assert apart_px < 0.1
