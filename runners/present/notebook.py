"""What an object says of itself at a prompt and in a notebook: short, whatever its size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

NAMES = 8  # of a list
ROWS = 30  # of an object that says one a line
LONGEST = 240  # characters of a text


def shortened(names: Sequence[str], shown: int = NAMES) -> str:
    """Return names in a line, the first of them where there are many."""
    listed = ", ".join(cut(name, 60) for name in names[:shown]) or "none"
    return f"{listed} and {len(names) - shown} more" if len(names) > shown else listed


def cut(text: str, longest: int = LONGEST) -> str:
    """Return a text on one line, its end left out where it is long."""
    text = " ".join(text.split())
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def html_page(
    heading: str,
    summary: Mapping[str, str],
    rows: Sequence[Sequence[str]] = (),
    attributes: Mapping[str, Any] | None = None,
) -> str:
    """Return a heading, a list of facts, a table whose first row is its head, and attributes that unfold."""
    parts = [f"<div><strong>{_text(heading)}</strong>", _facts(summary)]
    if rows:
        head = "".join(f"<th>{_text(x)}</th>" for x in rows[0])
        body = "".join("<tr>" + "".join(f"<td>{_text(x)}</td>" for x in row) + "</tr>" for row in rows[1:])
        parts.append(f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>")
    if attributes:
        told = {name: str(value) for name, value in list(attributes.items())[:40]}
        parts.append(f"<details><summary>computed from</summary>{_facts(told)}</details>")
    return "".join([*parts, "</div>"])


def html_of(text: str) -> str:
    """Return what an object says of itself at a prompt as HTML: its first line as heading, of 'what: fact' a row."""
    heading, *lines = text.splitlines()
    rows = "".join(
        f"<tr><th>{_text(what)}</th><td>{_text(fact)}</td></tr>"
        for what, _, fact in (line.strip().partition(": ") for line in lines[:ROWS])
    )
    more = f"<p>and {len(lines) - ROWS} more</p>" if len(lines) > ROWS else ""
    return f"<div><strong>{_text(heading)}</strong><table>{rows}</table>{more}</div>"


def _facts(facts: Mapping[str, str]) -> str:
    rows = "".join(f"<tr><th>{_text(name)}</th><td>{_text(text)}</td></tr>" for name, text in facts.items())
    return f"<table>{rows}</table>"


def _text(text: str) -> str:
    return escape(cut(text))
