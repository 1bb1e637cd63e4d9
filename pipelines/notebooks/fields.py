"""The displacement field and the strain between two pictures."""

# %% Two pictures of a texture: the second is stretched along x by one per cent
import chainwave as cw
import numpy as np

STRAIN = 0.01
wave = np.arange(1, 41)
kx, ky, phase = 0.9 * np.sin(wave), 0.9 * np.sin(2 * wave + 1), wave**2
rows, columns = np.mgrid[:120, :160].astype(float)


def picture(strain: float) -> np.ndarray:
    """Counts of 12 bits."""
    angle = kx * (columns / (1 + strain))[..., None] + ky * rows[..., None] + phase
    return np.rint(2000 + 150 * np.sin(angle).sum(axis=-1)).clip(0, 4095).astype(np.uint16)


# %% The field on a grid of our own
field = cw.correlate(picture(0.0), picture(STRAIN), half_size=12, step=8)
print(field, field.method)
u_px, x_px = field.grid("u_px"), field.grid("x_px")
print("u over x:", np.nanmedian(u_px / x_px))

# %% The strain that it states; the truth is Green and Lagrange's, e + e^2 / 2, or the stretch alone, which differ by less than 1e-4
strain = np.nanmedian(field["strain_xx"])
print("strain", strain, "+-", np.nanmedian(field["sigma_strain_xx"]))
assert abs(strain - STRAIN) < 5e-4
