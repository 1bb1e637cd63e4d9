"""Numbers with their uncertainties."""

from __future__ import annotations

from typing import NamedTuple, Optional


class Estimate(NamedTuple):
    """A measured number with its standard uncertainty, in the unit that ends its name.

    A number that is refused has neither value nor sigma nor interval, and the reason in `refused`.
    """

    #: Best estimate.
    value: Optional[float]
    #: Standard uncertainty.
    sigma: Optional[float]
    #: Ends of the 95 % interval.
    interval95: Optional[tuple[float, float]]
    #: Why there is no number; ``None`` where there is one.
    refused: Optional[str] = None

    def __float__(self) -> float:
        """The best estimate."""
        if self.value is None:
            from ._errors import ChainwaveError

            raise ChainwaveError(f"no number: {self.refused}")
        return self.value

    def __str__(self) -> str:
        if self.value is None:
            return f"refused: {self.refused}"
        return f"{self.value:.6g} +- {self.sigma:.2g}"


def estimates_of(
    numbers: list[tuple[str, tuple[Optional[tuple[float, float, tuple[float, float]]], Optional[str]]]],
) -> dict[str, Estimate]:
    """Numbers by their names; those that are refused with the reason."""
    return {
        name: Estimate(None, None, None, refused) if told is None else Estimate(*told)
        for name, (told, refused) in numbers
    }
