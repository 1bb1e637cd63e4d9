"""Pieces of the pages that notebooks show."""

from __future__ import annotations

from collections.abc import Iterable, Mapping


def table_of(values: Mapping[str, object]) -> str:
    """A table of two columns, names and values."""
    from html import escape

    rows = "".join(f"<tr><th>{escape(name)}</th><td>{escape(str(value))}</td></tr>" for name, value in values.items())
    return f"<table>{rows}</table>"


def list_of(items: Iterable[object]) -> str:
    """A list; nothing where there is no item."""
    from html import escape

    said = "".join(f"<li>{escape(str(item))}</li>" for item in items)
    return f"<ul>{said}</ul>" if said else ""
