"""What the documents name exists: every path, every public name, every command."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
TOPS = ("model", "codegen", "runners", "tests", "docs", "examples", "benchmarks", "generated", "tools")
PATH = re.compile(rf"(?<![\w/.-])((?:{'|'.join(TOPS)})/[\w./-]*\w/?)")
NAME = re.compile(r"\bascentwind(?:\.\w+)+")


def exists(path: str) -> bool:
    """Whether a path is there: in a source distribution the packages lie in ascentwind/ alone."""
    return (ROOT / path).exists() or (ROOT / "ascentwind" / path).exists()


def resolves(name: str) -> bool:
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:k]))
        except ModuleNotFoundError:
            continue
        try:
            for attribute in parts[k:]:
                found = getattr(found, attribute)
        except AttributeError:
            return False
        return True
    return False


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda d: d.name)
def test_paths_exist(document):
    missing = sorted({p for p in PATH.findall(document.read_text()) if not exists(p)})
    assert missing == [], f"{document.name} names what is not there"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda d: d.name)
def test_public_names_exist(document):
    missing = sorted({n for n in NAME.findall(document.read_text()) if not resolves(n)})
    assert missing == [], f"{document.name} names what is not there"


def test_missing_things_are_found():
    assert not exists("model/nowhere.py")
    assert not resolves("ascentwind.model.no_such_name")
    assert PATH.findall("see model/tables.py and (docs/data.md)") == ["model/tables.py", "docs/data.md"]
