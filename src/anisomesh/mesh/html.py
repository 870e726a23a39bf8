"""The table by which objects show themselves in notebooks."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape


def html_table(title: str, rows: Sequence[tuple[str, str]]) -> str:
    """Return rows of names and texts as an HTML table with a title; all of them are escaped."""
    cells = "".join(
        f'<tr><th style="text-align:left">{escape(name)}</th><td style="text-align:left">{escape(text)}</td></tr>'
        for name, text in rows
    )
    return f'<table><caption style="text-align:left">{escape(title)}</caption>{cells}</table>'
