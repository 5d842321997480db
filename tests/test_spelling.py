"""One spelling: prose is British, in pages, docstrings and comments; names in code and files are American."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest

from ascentwind.runners.present.wording import words

ROOT = Path(__file__).parents[1]
if not (ROOT / "pyproject.toml").is_file():
    pytest.skip("no source tree", allow_module_level=True)
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]
SOURCES = sorted(
    path
    for top in ("model", "codegen", "runners", "tests", "tools", "benchmarks", "docs")
    for path in (ROOT / top).rglob("*.py")
)
ENDS = (
    "linear|normal|discret|minim|maxim|optim|organ|initial|synthes|character|local|general|symbol|factor|random|vector|"
    "parametr|quant"
)
AMERICAN = re.compile(
    r"(?<![\w.`=/-])(?:cent(?:er(?:s|ed|ing|line)?)|colou?r(?<=color)s?|behaviors?|grays?|(?:kilo|milli|centi)?meters?|"
    rf"model(?:ed|ing)|label(?:ed|ing)|travel(?:ed|ing)|analyz\w+|favor\w*|neighbor\w*|(?:{ENDS})iz(?:e|es|ed|ing|ation))(?![\w=`(]|\.\w)",
    re.IGNORECASE,
)
NAMES = re.compile(r"Space Flight Center|Space Center|Flight Center|Research Center")


def american(text: str) -> list[str]:
    """Return American words of a text, but for what stands in backticks, is a parameter's name or that of a place."""
    return AMERICAN.findall(NAMES.sub("", re.sub(r"`+[^`]*`+|^ *[\w, *]+ : ", "", text, flags=re.M)))


def prose(source: str) -> list[str]:
    """Return the docstrings and comments of a Python source."""
    found = [
        ast.get_docstring(node) or ""
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
    ]
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    return [*found, *(token.string for token in tokens if token.type == tokenize.COMMENT)]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_pages_are_british(page):
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    text = re.sub(r"^ {4,}.*$|\]\([^)]*\)|https?://\S+", "", text, flags=re.M)
    assert american(text) == []


def test_docstrings_and_comments_are_british():
    found = {
        str(path.relative_to(ROOT)): words
        for path in SOURCES
        if (words := [word for text in prose(path.read_text(encoding="utf-8")) for word in american(text)])
    }
    assert found == {}


def test_names_are_shown_as_british_words():
    assert words("center_of_pressure") == "centre of pressure"


def test_american_words_are_found():
    assert american("the center of a gray meter, centered; colors and modeling") == [
        "center", "gray", "meter", "centered", "colors", "modeling",
    ]  # fmt: skip
    assert (
        american("`center_m`, center_of_pressure, the Space Flight Center, parameter, centre, color=, pyproject.center")
        == []
    )
