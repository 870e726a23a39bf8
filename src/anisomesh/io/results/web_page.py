"""Web pages of one file, with tables that sort when a heading is clicked."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

_CSS = (
    "body{font:15px/1.5 system-ui,sans-serif;margin:2em}table{border-collapse:collapse}"
    "th,td{padding:.2em .7em;border-bottom:1px solid #ddd;text-align:right;white-space:nowrap}"
    "th{position:sticky;top:0;background:#fff}th,td.text{text-align:left}td.long{white-space:normal;min-width:20em}"
    "th button{all:unset;font-weight:bold;cursor:pointer}th button:focus-visible{outline:2px solid}"
    '[aria-sort=ascending] button::after{content:" \\25B2"}[aria-sort=descending] button::after{content:" \\25BC"}'
)
_SCRIPT = """
function number(text) {
  return /^[-+]?[\\d,.]+(e[-+]?\\d+)?\\s?%?$/i.test(text) ? parseFloat(text.replace(/,/g, "")) : NaN;
}
function compare(a, b) {
  const x = number(a), y = number(b);
  if (!isNaN(x) && !isNaN(y)) return x - y;
  if (isNaN(x) !== isNaN(y)) return isNaN(x) ? 1 : -1;
  return a.localeCompare(b);
}
document.querySelectorAll("th button").forEach(button => button.addEventListener("click", () => {
  const head = button.parentElement, column = head.cellIndex, body = head.closest("table").tBodies[0];
  const down = head.getAttribute("aria-sort") === "ascending";
  const text = row => row.cells[column].textContent.trim();
  const rows = [...body.rows].sort((a, b) => (down ? -1 : 1) * compare(text(a), text(b)));
  const empty = row => ["", "-"].includes(text(row));
  for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", down ? "descending" : "ascending");
  body.append(...rows.filter(row => !empty(row)), ...rows.filter(empty));
}));
"""
_LONG_CELL = 60  # characters of a cell that is shown on several lines


class Html(str):
    """The HTML of a cell, in place of its text."""


def table(heading: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """Return a table that sorts by a column when its heading is clicked.

    Parameters
    ----------
    heading, lines
        The cells as texts; numbers are sorted as numbers, and ``""`` and ``-`` last. A cell of type :class:`Html` is
        used as it is.
    """
    head = "".join(f'<th scope="col"><button>{escape(cell)}</button></th>' for cell in heading)
    body = "\n".join("<tr>" + "".join(map(_cell, line)) + "</tr>" for line in lines)
    return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table>"


def web_page(title: str, parts: Sequence[str]) -> str:
    """Return a page of one file with a title and parts that are HTML, such as tables."""
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>\n'
        f"<style>{_CSS}</style></head><body>\n" + "\n".join(part for part in parts if part) + "\n"
        f"<script>{_SCRIPT}</script></body></html>\n"
    )


def _cell(cell: str) -> str:
    if isinstance(cell, Html):
        return f'<td class="text">{cell}</td>'
    if cell[:1].isdigit() or cell == "-":
        return f"<td>{escape(cell)}</td>"
    return f'<td class="{"text long" if len(cell) > _LONG_CELL else "text"}">{escape(cell)}</td>'
