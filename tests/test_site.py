"""The documentation site: every public name on its page with a docstring, every page in its menu, its formulas."""

from __future__ import annotations

import inspect
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

import ascentwind
from ascentwind import errors

ROOT = Path(__file__).parents[1]
if not (ROOT / "mkdocs.yml").is_file():
    pytest.skip("no source tree", allow_module_level=True)
PUBLIC = [name for name in dir(ascentwind) if name not in ("errors", "__version__")]
API = (ROOT / "docs" / "api.md").read_text() if (ROOT / "docs" / "api.md").is_file() else ""


def test_the_page_of_names_is_what_its_program_writes():
    program = runpy.run_path(str(ROOT / "tools" / "write_api_page.py"))
    assert program["page"]() == API, "docs/api.md is out of date: run python tools/write_api_page.py"


@pytest.mark.parametrize(("module", "name"), [(ascentwind, n) for n in PUBLIC] + [(errors, n) for n in dir(errors)])
def test_every_public_name_is_told(module, name):
    thing = getattr(module, name)
    assert (inspect.getdoc(thing) or "").strip()
    assert vars(thing).get("__doc__") if inspect.isclass(thing) else thing.__doc__  # its own, no base class's
    assert len(re.findall(rf"^::: ascentwind\.[\w.]+\.{name}$", API, re.M)) == 1


def test_every_page_is_in_the_menu():
    menu, docs = (ROOT / "mkdocs.yml").read_text().partition("\nnav:")[2], ROOT / "docs"
    named = re.findall(r": ([\w/-]+\.(?:md|py))$", menu, re.M)
    there = [*docs.glob("*.md"), *(docs / "tutorials").glob("*.py")]
    assert sorted(named) == sorted(p.relative_to(docs).as_posix() for p in there)


def test_the_gallery_shows_every_figure():
    shown = re.findall(r"\(figures/(\w+\.png)\)", (ROOT / "docs" / "gallery.md").read_text())
    assert sorted(shown) == sorted(p.name for p in (ROOT / "docs" / "figures").iterdir())


def test_formulas_become_those_of_the_site():
    hooks = runpy.run_path(str(ROOT / "tools" / "site_hooks.py"))
    text = "of $`t_2`$:\n\n```math\na = b\n```\n\n```sh\necho $HOME\n```\n"
    assert hooks["on_page_markdown"](text) == "of $t_2$:\n\n$$\na = b\n$$\n\n```sh\necho $HOME\n```\n"
    assert hooks["on_page_content"]("what :func:<code>f</code> returns: x") == "what <code>f</code> returns: x"


@pytest.mark.slow
def test_the_site_is_built_without_a_warning(tmp_path):
    pytest.importorskip("mkdocs")
    pytest.importorskip("material")
    pytest.importorskip("mkdocstrings")
    pytest.importorskip("mkdocs_jupyter")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--config-file", str(ROOT / "mkdocs.yml")]
    done = subprocess.run(
        [*command, "-d", str(tmp_path / "site")], capture_output=True, text=True, check=False,
        env={**os.environ, "ASCENTWIND_RUN_TUTORIALS": "false"}, cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    page = (tmp_path / "site" / "api" / "index.html").read_text(encoding="utf-8")
    for name in (*PUBLIC, *dir(errors)):
        assert re.search(rf'id="ascentwind\.[\w.]+\.{name}"', page), name
