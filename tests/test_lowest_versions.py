"""The lowest versions that are tried are those that pyproject.toml promises."""

from __future__ import annotations

import runpy
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
if not (ROOT / "tools" / "lowest_versions.py").is_file():
    pytest.skip("no source tree", allow_module_level=True)


@pytest.mark.parametrize(
    ("requirement", "lowest"),
    [("numpy>=2.0", "numpy==2.0"), ("casadi>=3.8.2,<3.9", "casadi==3.8.2"), ("lazy-loader>=0.4", "lazy-loader==0.4")],
)
def test_the_lowest_version(requirement, lowest):
    assert runpy.run_path(str(ROOT / "tools" / "lowest_versions.py"))["lowest"](requirement) == lowest


def test_every_dependency_has_one():
    program = runpy.run_path(str(ROOT / "tools" / "lowest_versions.py"))
    for requirement in tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]:
        assert "==" in program["lowest"](requirement)
