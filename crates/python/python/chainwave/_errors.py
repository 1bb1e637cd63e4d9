"""What goes wrong, and what should be known."""

from __future__ import annotations

__all__ = ["ChainwaveError", "ChainwaveWarning", "MissingFileError"]


class ChainwaveError(ValueError):
    """Why something could not be done: file, place, what was expected, what was found, and a hint where there is one."""

    __module__ = "chainwave"


class MissingFileError(ChainwaveError, FileNotFoundError):
    """A file that is not there."""

    __module__ = "chainwave"


class ChainwaveWarning(UserWarning):
    """What a careful reader of the results should know."""

    __module__ = "chainwave"
