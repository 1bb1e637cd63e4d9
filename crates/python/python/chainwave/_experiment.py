"""An experiment from its recordings to its results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Optional, Union

from . import _chainwave, _html
from ._columns import Columns, Path, TableLike, columns_of, is_path, threads_of
from ._errors import ChainwaveError
from ._estimate import Estimate, estimates_of
from ._figure import Figure
from ._models import text_of
from ._recording import Recording, open, warn
from ._table import Table
from ._wave import Wave

if TYPE_CHECKING:
    from ._tracking import Progress


class Finding(NamedTuple):
    """What the reader should know."""

    #: Its kind, in a word.
    code: str
    #: What it is about.
    subject: str
    #: What was expected and found.
    text: str

    def __str__(self) -> str:
        return f"{self.subject}: {self.text}"


class RecordingState(NamedTuple):
    """What became of a recording."""

    recording: str
    view: int
    trial: int
    #: ``used``, ``left_out`` or ``failed``.
    state: str
    #: Why it is not used.
    reason: Optional[str]


class Results(Wave):
    """What a run of an experiment found."""

    def __init__(self, inner: _chainwave.ExperimentResults) -> None:
        import json

        figures = {name: Figure(figure) for name, figure in inner.figures}
        super().__init__(estimates_of(inner.numbers), dict(inner.tables), figures)
        #: Nominal velocity of the striker, in metres per second.
        self.nominal_striker_velocity_m_per_s: float | None = inner.striker_velocity_m_per_s
        #: What the reader should know.
        self.warnings: list[Finding] = [Finding(*one) for one in inner.warnings]
        #: What became of each recording.
        self.recordings: list[RecordingState] = [RecordingState(*one) for one in inner.recordings]
        #: `correlation` of c_d and c_s, `damping_from` which fit, `group_velocity_gaps`, `reduced_chi_squared` of the fit to the tracks.
        self.details: dict[str, Any] = json.loads(inner.details)
        #: What was modelled: `question`, `choice`, `rule`, `evidence` of each decision.
        self.decisions: list[dict[str, str]] = json.loads(inner.decisions)

    @property
    def group_velocity_variation(self) -> Estimate:
        """Velocity over the last third of the gaps less that over the first, relative to the velocity."""
        return self._numbers["group_velocity_variation"]

    @property
    def particle_velocity_m_per_s(self) -> Estimate:
        """Velocity of the bodies as the pulse's peak passes, on average over the gaps."""
        return self._numbers["particle_velocity_m_per_s"]

    @property
    def c_d_kg_per_s(self) -> Estimate:
        """Damping of each body to ground."""
        return self._numbers["c_d_kg_per_s"]

    @property
    def c_s_kg_per_s(self) -> Estimate:
        """Damping of the striker's contact."""
        return self._numbers["c_s_kg_per_s"]

    @property
    def striker_velocity_m_per_s(self) -> Estimate:
        """Mean striker velocity as the fit to the tracks found it."""
        return self._numbers["striker_velocity_m_per_s"]

    @property
    def tracks(self) -> Table:
        """`recording`, `name` (the body), `frame`, `t_s`, `x_px`, `y_px`, their sigmas, ..., `status`, `method`."""
        return self._tables["tracks"]

    @property
    def motion(self) -> Table:
        """`t_s`, `body`, `x_m`, `sigma_m`, ..., `n_trials`."""
        return self._tables["motion"]

    @property
    def motion_by_model(self) -> Optional[Table]:
        """The motion aligned by the chain model, with the same columns; ``None`` where the tracks do not accept the model."""
        return self._tables.get("motion_by_model")

    def _html_notes(self) -> str:
        return _html.list_of(self.warnings)


def _held(name: str, given: Any, rate_hz: Optional[float], partial: bool) -> Recording:
    """The recording that a trial names."""
    if isinstance(given, Recording):
        return given
    if is_path(given):
        return open(given, rate_hz=rate_hz, partial=partial)
    if rate_hz is None:
        raise ChainwaveError(
            f"{name}: expected times, found an array alone (hint: rate_hz in the experiment's camera, or Recording.from_array with times_s)"
        )
    return Recording.from_array(given, rate_hz=rate_hz, name=name)


class Experiment:
    """An experiment: one chain, filmed in several views and trials.

    Parameters
    ----------
    experiment : path or dict
        ``experiment.toml``, or a dict of the same tables. Files that it names are looked for beside it, those of a dict in the current
        folder. A dict's `trials` may be a table itself: `recording`, `view`, `trial`, `stage_m`, ...
    recordings : path, or dict of recordings, paths and arrays, optional
        Folder of the recordings that the trials name; the experiment's own when left out. A dict holds recordings by those names: a
        :class:`Recording` with its own times, a path, or an array of shape ``(n_frames, height, width)``, whose rate the experiment's
        `camera` states as `rate_hz`, with the trigger at its first frame.
    partial : bool, optional
        Take the whole frames of recordings that were cut short.

    Notes
    -----
    What was tracked is kept as long as the object is: a run after an interrupted one continues from there.
    """

    def __init__(
        self,
        experiment: Union[Path, Mapping[str, Any]],
        recordings: Union[Path, Mapping[str, Any], None] = None,
        *,
        partial: bool = False,
    ) -> None:
        import os

        trials: Optional[Columns] = None
        if isinstance(experiment, Mapping):
            given: TableLike = experiment.get("trials")
            if given is not None and not is_path(given):
                trials = columns_of(given, "trials")
                experiment = {**experiment, "trials": "trials (a table)"}
        path, text = text_of(experiment, "experiment")
        held: Mapping[str, Any] = {}
        folder: Optional[str] = None
        if isinstance(recordings, Mapping):
            held = recordings
        elif recordings is not None:
            folder = os.fspath(recordings)
        inner = _chainwave.PreparedExperiment(path, text, recordings=folder, trials=trials, partial=partial)
        if held:
            opened = {name: _held(name, given, inner.rate_hz, partial) for name, given in held.items()}
            inner = inner.with_recordings([(name, one._inner) for name, one in opened.items()])
        self._inner = inner

    @property
    def name(self) -> str:
        """Its name."""
        return self._inner.name

    @property
    def recordings(self) -> list[str]:
        """The recordings that its trials name."""
        return self._inner.recordings

    def check(self, *, threads: Optional[int] = None) -> list[Finding]:
        """What contradicts the experiment, before time is spent on it."""
        return [Finding(*one) for one in self._inner.check(n_threads=threads_of(threads))]

    def run(self, *, threads: Optional[int] = None, progress: Optional[Progress] = None) -> Results:
        """Track, stitch, measure and fit, with the same bits as ``chainwave run``.

        Parameters
        ----------
        threads : int, optional
            All cores when left out; the bits are the same for any number.
        progress : callable, optional
            Called with stage, frames done and frames planned; what it raises ends the work.

        Raises
        ------
        ChainwaveError
            The experiment makes no sense, no recording can be tracked, or the tracks cannot be evaluated; also an experiment of several
            striker velocities, which :meth:`run_all` runs.

        Warns
        -----
        ChainwaveWarning
            What the reader should know, also in :attr:`Results.warnings`, and each recording that is not used.
        """
        if len(self._inner) != 1:
            raise ChainwaveError(f"{self.name}: {len(self._inner)} striker velocities (hint: run_all gives results for each)")
        return self._run(0, threads, progress)

    def run_all(self, *, threads: Optional[int] = None, progress: Optional[Progress] = None) -> list[Results]:
        """As :meth:`run`, for each striker velocity, fastest first.

        A velocity that fails causes a warning, and the results of the others are returned.

        Raises
        ------
        ChainwaveError
            No velocity could be run.
        """
        velocities = self._inner.velocities
        results: list[Results] = []
        failures: list[ChainwaveError] = []
        for striker, velocity in enumerate(velocities):
            try:
                results.append(self._run(striker, threads, progress))
            except ChainwaveError as error:
                failures.append(error)
                if len(velocities) > 1:
                    warn(f"striker {velocity:g} m/s: {error}", stacklevel=2)
        if failures and not results:
            if len(failures) == 1:
                raise failures[0]
            reasons = "; ".join(dict.fromkeys(str(error) for error in failures))
            raise ChainwaveError(f"{self.name}: none of {len(failures)} striker velocities could be run: {reasons}") from failures[0]
        return results

    def _run(self, striker: int, threads: Optional[int], progress: Optional[Progress]) -> Results:
        results = Results(self._inner.run(striker, n_threads=threads_of(threads), progress=progress))
        for finding in results.warnings:
            warn(str(finding), stacklevel=3)
        for one in results.recordings:
            if one.state == "failed":
                warn(f"{one.recording}: {one.reason}", stacklevel=3)
        return results

    def __repr__(self) -> str:
        return f"<chainwave.Experiment {self.name!r}: {len(self.recordings)} recordings>"

    def _repr_html_(self) -> str:
        return _html.table_of({"experiment": self.name}) + _html.list_of(self.recordings)
