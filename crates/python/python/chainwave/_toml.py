"""Dicts as the TOML text that the library reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from . import _chainwave


def toml_of(tables: Mapping[str, Any]) -> str:
    """The text of a dict; ``None`` is left out, paths are texts, NumPy's numbers and arrays are numbers and lists."""
    plain: dict[str, Any] = _plain(tables)
    return _chainwave.toml_of_dict(plain)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(name): _plain(item) for name, item in value.items() if item is not None}
    if hasattr(value, "tolist"):
        return value.tolist()
    if hasattr(value, "__fspath__"):
        return value.__fspath__()
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value
