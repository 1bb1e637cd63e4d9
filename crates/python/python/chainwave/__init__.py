"""From high-speed recordings of an impacted chain to its wave, every number with its uncertainty.

What the command ``chainwave`` does, with the same bits::

    import chainwave as cw

    recording = cw.open("shot.cine")
    recording[0]                                   # counts, shape (height, width)
    tracks = cw.track(recording, "points.csv")     # polars.DataFrame(tracks), tracks["x_px"]
    law = cw.fit_contact("curve.csv")              # law.p.value, law.p.sigma
    motion = cw.simulate("scene.toml")             # motion.summary
    results = cw.Experiment("experiment.toml").run()
    results.c_d_kg_per_s.value, results.strain

Tracks of any origin go the same way by pieces: :func:`merge`, :func:`measure`, :func:`fit`.

SI units, the unit last in a name; positions in pictures are in pixels, (0, 0) being the centre of the top left one; t = 0 is the
trigger. A lost value is null in tables (NaN in NumPy arrays, which know no null).
"""

from __future__ import annotations

from ._chainwave import __version__
from ._errors import ChainwaveError, ChainwaveWarning, MissingFileError
from ._estimate import Estimate
from ._experiment import Experiment, Finding, RecordingState, Results
from ._figure import Figure, Shown
from ._models import ContactLaw, Motion, fit_contact, simulate
from ._pieces import Fit, Measurement, MergedMotion, fit, measure, merge, strain_map
from ._recording import Recording, open
from ._strain import StrainMap
from ._table import Table
from ._tracking import Field, Subset, Tracks, correlate, track

__all__ = [
    "ChainwaveError",
    "ChainwaveWarning",
    "ContactLaw",
    "Estimate",
    "Experiment",
    "Field",
    "Figure",
    "Finding",
    "Fit",
    "Measurement",
    "MergedMotion",
    "MissingFileError",
    "Motion",
    "Recording",
    "RecordingState",
    "Results",
    "Shown",
    "StrainMap",
    "Subset",
    "Table",
    "Tracks",
    "__version__",
    "correlate",
    "fit",
    "fit_contact",
    "measure",
    "merge",
    "open",
    "simulate",
    "strain_map",
    "track",
]
