"""The strain of a chain over gaps and time, as a table and as a map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional

from ._table import Table

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class StrainMap(Table):
    """Strain of every gap over time: a row for each gap and time at which it is known.

    Columns: `t_s`, `gap` (from 1, the struck end), `strain` (compression is negative), `sigma`.
    """

    @property
    def gaps(self) -> NDArray[np.uint32]:
        """The gaps that are known at any time, shape ``(n_gaps,)``."""
        import numpy as np

        return np.unique(self["gap"])

    @property
    def times_s(self) -> NDArray[np.float64]:
        """The times at which any gap is known, in seconds after the trigger, shape ``(n_times,)``."""
        import numpy as np

        return np.unique(self["t_s"])

    def grid(self, name: str = "strain") -> NDArray[np.float64]:
        """A column over gaps and times, shape ``(n_gaps, n_times)``; NaN where it is not known.

        Parameters
        ----------
        name : {"strain", "sigma"}, optional
            The column.

        Returns
        -------
        ndarray
            Dimensionless; rows are those of :attr:`gaps`, columns those of :attr:`times_s`.

        Examples
        --------
        >>> import chainwave as cw
        >>> import numpy as np
        >>> body, t_s = np.meshgrid([1, 2, 3], np.arange(8) * 1e-5, indexing="ij")
        >>> x_m = np.where((body == 1) & (t_s > 0), 3e-5, 0.0)
        >>> strain = cw.strain_map({"t_s": t_s.ravel(), "body": body.ravel(), "x_m": x_m.ravel()}, pitch_m=0.03)
        >>> strain.grid().shape
        (2, 8)
        >>> strain.grid()[0, :3].round(6).tolist()
        [0.0, -0.001, -0.001]
        """
        import numpy as np

        gaps, row = np.unique(self["gap"], return_inverse=True)
        times_s, column = np.unique(self["t_s"], return_inverse=True)
        values = np.full((len(gaps), len(times_s)), np.nan)
        values[row, column] = self[name]
        return values

    def plot(self, ax: Optional[Any] = None, **options: Any) -> Any:
        """Draw the map with matplotlib, which is imported here alone: compression in percent over time in milliseconds and gap.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; axes of a new figure when left out.
        **options
            For :meth:`matplotlib.axes.Axes.pcolormesh`.

        Returns
        -------
        matplotlib.axes.Axes
            What was drawn on.
        """
        if ax is None:
            from matplotlib import pyplot

            ax = pyplot.figure().subplots()
        percent = -100.0 * self.grid()
        mesh = ax.pcolormesh(1e3 * self.times_s, self.gaps, percent, **{"shading": "nearest", **options})
        ax.figure.colorbar(mesh, ax=ax, label="compressive strain (%)")
        ax.set_xlabel("time after the trigger (ms)")
        ax.set_ylabel("gap")
        return ax
