"""Trials that another program tracked: merged, measured and fitted. And an experiment as a whole, where there is one."""

# %% Three trials of a chain whose dampings we know, each with a striker and a trigger of its own, and noise of 5 um
import os
import warnings

import chainwave as cw
import numpy as np

C_D, C_S, SIGMA_M = 0.02, 0.2, 5e-6
SCENE = {
    "model": "chain",
    "n_bodies": 8,
    "duration_s": 6e-3,
    "output_interval_s": 2e-5,
    "body": {"mass_kg": 0.455e-3, "pitch_m": 0.030, "damping_kg_per_s": C_D},
    "contact": {"law": "power", "a": 60.1, "delta_0_m": 2.27e-3, "p": 0.114},
    "drive": {"kind": "striker", "mass_kg": 4.3e-3, "velocity_m_per_s": 2.0, "damping_kg_per_s": C_S},
}
random = np.random.default_rng(2)


def trial(velocity_m_per_s: float, late_s: float) -> dict[str, np.ndarray]:
    """What a tracker would write of a trial: body, t_s, x_m, sigma_m; the chain rests for 1 ms before the impact."""
    motion = cw.simulate({**SCENE, "drive": {**SCENE["drive"], "velocity_m_per_s": velocity_m_per_s}})
    bodies, times_s, x_m = [], [], []
    frames_s = np.arange(-50, 280) * 2e-5
    for body in range(1, 9):
        own = motion["body"] == body
        moved_m = np.interp(frames_s - late_s, motion["t_s"][own], motion["x_m"][own], left=0.0)
        bodies.append(np.full(frames_s.size, body))
        times_s.append(frames_s)
        x_m.append(0.030 * body + moved_m + random.normal(0.0, SIGMA_M, frames_s.size))
    n = 8 * frames_s.size
    return {
        "body": np.concatenate(bodies),
        "t_s": np.concatenate(times_s),
        "x_m": np.concatenate(x_m),
        "sigma_m": np.full(n, SIGMA_M),
    }


trials = [trial(2.00, 0.0), trial(2.04, 7e-6), trial(1.97, -4e-6)]

# %% One motion of them
with warnings.catch_warnings():
    warnings.simplefilter("ignore", cw.ChainwaveWarning)
    merged = cw.merge(trials, rest_until_s=-1e-4, drive_scatter=0.02)
print(merged)
for one in merged.alignments:
    print(one["recording"], f"trigger {1e6 * one['trigger_offset_s']:.2f} us, drive {100 * one['drive_deviation']:.2f} %")

# %% Its wave, and the dampings
measured = cw.measure(merged, pitch_m=0.030, first_gap=2, end_reflects=True)
print(measured)
with warnings.catch_warnings():
    warnings.simplefilter("ignore", cw.ChainwaveWarning)
    fitted = cw.fit(merged, SCENE, striker_velocity_sigma_m_per_s=0.04)
print(fitted)
c_d = fitted.c_d_kg_per_s
assert c_d.value is not None and abs(c_d.value - C_D) < 4 * c_d.sigma

# %% An experiment of recordings: named by the environment, as its films take a minute
if "CHAINWAVE_EXPERIMENT" in os.environ:
    results = cw.Experiment(os.environ["CHAINWAVE_EXPERIMENT"]).run(progress=print)
    print(results)
