"""Tables as text and as HTML."""

from __future__ import annotations

import difflib
import html
from collections.abc import Iterable, Sequence
from typing import Any

Row = tuple[str, Any, str]


def unknown(found: str, known: Sequence[str]) -> str:
    """Returns the message for an unknown name, with the nearest known ones."""
    near = difflib.get_close_matches(found, known, 3, 0.5) or [it for it in known if it.startswith(found)]
    return f"{found!r}: {'did you mean ' + ' or '.join(near) + '?' if near else 'expected ' + ', '.join(known)}"


def number(it: Any) -> str:
    """Returns a number with four digits; `-` for none."""
    if it is None:
        return "-"
    if isinstance(it, bool):
        return "yes" if it else "no"
    if isinstance(it, (int, str)):
        return str(it)
    return f"{it:.4g}"


def text(title: str, sections: Iterable[tuple[str, Sequence[Row]]]) -> str:
    """Returns sections of label, value and unit as aligned text."""
    shown = [(name, [(label, number(it), unit) for label, it, unit in rows]) for name, rows in sections if rows]
    # A label alone is a sentence and has no column.
    every = [row for _, rows in shown for row in rows if row[1] or row[2]]
    labels = max((len(row[0]) for row in every), default=0)
    values = max((len(row[1]) for row in every), default=0)
    lines = [title]
    for name, rows in shown:
        lines.append(name)
        for label, it, unit in rows:
            row = f"  {label:<{labels}}  {it:>{values}}  {unit}" if it or unit else f"  {label}"
            lines.append(row.rstrip())
    return "\n".join(lines)


def page(title: str, sections: Iterable[tuple[str, Sequence[Row]]]) -> str:
    """Returns sections of label, value and unit as an HTML table."""
    rows = []
    for name, inside in sections:
        if inside:
            rows.append(f"<tr><th colspan=3 style='text-align:left'>{html.escape(name)}</th></tr>")
        for label, it, unit in inside:
            cells = (html.escape(label), html.escape(number(it)), html.escape(unit))
            rows.append("<tr><td>{}</td><td style='text-align:right'>{}</td><td>{}</td></tr>".format(*cells))
    return f"<table><caption>{html.escape(title)}</caption>{''.join(rows)}</table>"
