"""What a package index shows: stated twice and equal, and nothing that points beside the page."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
if not (ROOT / "pyproject.toml").is_file():
    pytest.skip("no source tree", allow_module_level=True)
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def cited(key: str) -> str:
    found = re.search(rf"^{key}: (.+)$", (ROOT / "CITATION.cff").read_text(), re.M)
    assert found is not None
    return found[1]


def test_version_and_licence_are_those_of_the_citation():
    assert PROJECT["version"] == cited("version")
    assert PROJECT["license"] == cited("license")
    assert f"## {PROJECT['version']}" in (ROOT / "CHANGELOG.md").read_text()


def test_authors_are_those_of_the_citation():
    names = re.findall(r"^  - name: (.+)$", (ROOT / "CITATION.cff").read_text().partition("references:")[0], re.M)
    assert [a["name"] for a in PROJECT["authors"]] == names


def test_python_versions_agree():
    lowest = re.fullmatch(r">=3\.(\d+)", PROJECT["requires-python"])
    assert lowest is not None
    named = [int(c.rpartition(".")[2]) for c in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", c)]
    assert named == list(range(int(lowest[1]), max(named) + 1))


def test_every_dependency_has_a_lowest_version():
    extras = [r for group in PROJECT["optional-dependencies"].values() for r in group]
    assert [r for r in (*PROJECT["dependencies"], *extras) if ">=" not in r] == []


def targets(text: str) -> list[str]:
    return re.findall(r"\]\(([^)\s]+)\)", text)


def test_the_readme_points_nowhere_that_an_index_page_has_not():
    assert [t for t in targets((ROOT / "README.md").read_text()) if not t.startswith("https://")] == []


def test_relative_targets_are_found():
    assert targets("see [a](docs/a.md) and ![b](https://c.d/e.png)") == ["docs/a.md", "https://c.d/e.png"]
