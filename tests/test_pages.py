"""What the pages show: every block of a known kind, every command and option there, every TOML readable."""

from __future__ import annotations

import re
import shlex
import tomllib
from typing import Any

import pytest
import typer
from page_blocks import PAGES, ROOT, blocks_of

from ascentwind.runners.cli.app import app

if not (ROOT / "mkdocs.yml").is_file():
    pytest.skip("no source tree", allow_module_level=True)
BLOCKS = [block for page in PAGES for block in blocks_of(page)]
COMMAND = re.compile(r"`(ascentwind(?: [^`]*)?)`")
WORD = re.compile(r"[a-z][a-z-]*")


def told(text: str) -> list[str]:
    """Return the commands that a text names in backticks."""
    return [" ".join(found.split()) for found in COMMAND.findall(text)]


def fault(command: str) -> str | None:
    """Return what is wrong with a command as a page writes it, with or without its values; None where all is known."""
    group: Any = typer.main.get_command(app)
    words = shlex.split(command.replace("[", " ").replace("]", " "), comments=True)[1:]
    while words and hasattr(group, "get_command") and WORD.fullmatch(words[0]):
        names = words.pop(0).split(",")
        found = group.get_command(None, names[0])
        if found is None:
            return f"no command {names[0]}"
        group = found
    known = {name for parameter in group.params for name in (*parameter.opts, *parameter.secondary_opts)}
    for word in words:
        if word.startswith("--") and (name := word.partition("=")[0]) not in known | {"--help", "--version", "--json"}:
            return None if name in ("--install-completion",) else f"no option {name}"
    return None


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_command_named_is_there(page):
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    assert {c: fault(c) for c in told(text) if fault(c)} == {}


def test_what_is_not_there_is_found():
    assert fault("ascentwind runn as504") == "no command runn"
    assert fault("ascentwind run as504 --sett a=1") == "no option --sett"
    assert fault("ascentwind wind aply X") == "no command aply"
    assert fault("ascentwind wind fit --top 30000") is None
    assert told("see `ascentwind run\nas504` and `ascentwind`") == ["ascentwind run as504", "ascentwind"]


def test_every_block_is_of_a_known_kind():
    assert [(b.page.name, b.line) for b in BLOCKS if b.kind not in ("sh", "python", "toml", "math")] == []


def test_every_toml_is_readable():
    for block in BLOCKS:
        if block.kind == "toml":
            try:
                tomllib.loads(block.text)
            except tomllib.TOMLDecodeError as error:
                raise AssertionError(f"{block.page.name}, line {block.line}: {error}") from None


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_no_command_hides_in_an_indented_block(page):
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    assert re.findall(r"^ {4,}(?:ascentwind |import |from \w+ import |study\.).*$", text, re.M) == []


def test_what_is_not_run_says_why():
    assert all(len(block.why_not) > 10 for block in BLOCKS if block.why_not is not None)
    marks = sum(page.read_text(encoding="utf-8").count("<!-- not run:") for page in PAGES)
    assert marks == sum(block.why_not is not None for block in BLOCKS)  # no mark stands beside its block
