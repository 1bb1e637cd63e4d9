"""A contact law from a compression curve, the chain that has it, and its wave."""

# %% A curve of the paper's law, with the noise of a load cell
import chainwave as cw
import numpy as np

overlap_m = np.linspace(0.0, 4e-3, 120)
force_n = 60.1 * ((overlap_m + 2.27e-3) ** 0.114 - 2.27e-3**0.114)
force_n += np.random.default_rng(1).normal(0.0, 5e-3, overlap_m.size)
law = cw.fit_contact({"overlap_m": overlap_m, "force_n": force_n})
print(law)
for sentence in law.details["cannot_tell_apart"]:
    print("-", sentence)

# %% A chain with this law, struck at 2.73 m/s
motion = cw.simulate(
    {
        "model": "chain",
        "n_bodies": 16,
        "duration_s": 8e-3,
        "output_interval_s": 2e-5,
        "body": {"mass_kg": 0.455e-3, "pitch_m": 0.030, "damping_kg_per_s": 0.003},
        "contact": law.as_contact(),
        "drive": {"kind": "striker", "mass_kg": 4.3e-3, "velocity_m_per_s": 2.73, "damping_kg_per_s": 0.2},
    }
)
print(motion, motion.summary["method"], "energy drift", motion.summary["energy_drift"])

# %% Its wave. A computed motion has no uncertainty, so sigma is 0
measured = cw.measure(motion, pitch_m=0.030, first_gap=3, end_reflects=True, contact=law.as_contact())
print(measured)
assert measured.group_velocity_m_per_s.value > 0
