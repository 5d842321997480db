"""Every command and every block of Python of the pages, run in their order: pytest -m pages, a step of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from page_blocks import PAGES, ROOT, WALKED, Block, blocks_of
from sounding_files import igra_text, own_text

if not (ROOT / "mkdocs.yml").is_file():
    pytest.skip("no source tree", allow_module_level=True)
pytestmark = [pytest.mark.pages, pytest.mark.slow]

LIMITS = "time [s],bending_moment [N m]\n10,60e6\n150,60e6\n"
STUDY = "import ascentwind as aw\nfrom ascentwind import Study\nstudy = Study.load('as504')\n"
# what a page's Python takes as known, for it leaves that to its reader
KNOWN = {
    "gusts.md": STUDY + "load = study.flight_load('bending_moment', (70.0, 76.0), draws=200)\n",
    "measured-winds.md": STUDY + "import numpy as np\n",
    "systems-from-numbers.md": """
        import casadi as ca
        import numpy as np
        times, values = np.array([0.0, 1.0, 2.0]), np.array([1.0, 2.0, 1.5])
        A, B, C = np.array([[[0.0, 1.0], [-1.0, -k]] for k in values]), np.array([[0.0, 0.0], [1.0, 0.5]]), np.eye(2)
        D, E, G, u = np.zeros((2, 2)), np.array([[0.0], [1.0]]), np.zeros((2, 1)), np.ones((3, 1))
        names = {"states": ["x", "v"], "noises": ["gust 1", "gust 2"], "outputs": ["x", "v"], "inputs": ["push"]}
        t, x, n, a = (ca.SX.sym(s) for s in ("t", "x", "n", "a"))
        """,
    "two-planes.md": "from ascentwind import Study\n"
    "study, times = Study.load('as504', changes={'planes': 'both'}), [70.0, 75.0]\n",
}


def a_rocket(folder: Path) -> None:
    """The reader's own vehicle."""
    command = [
        sys.executable,
        "-m",
        "ascentwind",
        "new-vehicle",
        "my_rocket",
        "--from",
        "falcon1",
        "--name",
        "my_rocket",
    ]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, stdin=subprocess.DEVNULL)


def limits(folder: Path) -> None:
    """Limits of the bending moment over the flight."""
    (folder / "limits.csv").write_text(LIMITS, encoding="utf-8")


def winds(folder: Path) -> None:
    """The reader's soundings: some years of March, balloons, and a rocket with limits."""
    a_rocket(folder)
    limits(folder)
    random, altitude = np.random.default_rng(1), np.arange(0.0, 16001.0, 500.0)
    smooth = np.exp(-np.abs(altitude[:, None] - altitude) / 4000)
    root = 8 * np.linalg.cholesky(smooth)
    u, v = (
        15 + random.standard_normal((90, altitude.size)) @ root.T,
        random.standard_normal((90, altitude.size)) @ root.T,
    )
    import zipfile

    with zipfile.ZipFile(folder / "USM00074794-data.txt.zip", "w") as packed:
        packed.writestr("USM00074794-data.txt", igra_text(altitude, u, v, when=days(range(3), [3])))
    (folder / "mine.csv").write_text(own_text(altitude, *np.tile([u, v], (1, 4, 1))), encoding="utf-8")
    for name, row in (("balloon", 0), ("early", 0), ("late", 1), ("later", 1)):
        rows = [
            f"{name},{h:.0f},{along:.2f},{across:.2f}"
            for h, along, across in zip(altitude, u[row], v[row], strict=True)
        ]
        lines = ["profile,altitude [m],u [m/s],v [m/s]", *rows]
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def days(years, months):
    import datetime

    return [
        datetime.datetime(2003 + year, month, day, 12) for year in years for month in months for day in range(1, 31)
    ]


# what of the reader's own lies in the folder
FILES: dict[str, list[Callable[[Path], None]]] = {
    "reports.md": [limits],
    "measured-winds.md": [winds],
    "two-planes.md": [a_rocket],
    "wind.md": [a_rocket],
}


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """Where a reader sits: this environment's programs, the project's examples, and a pip that installs nothing."""
    programs = tmp_path / "programs"
    programs.mkdir()
    (programs / "pip").write_text(f"#!{sys.executable}\n" + textwrap.dedent(PIP), encoding="utf-8")
    for name, code in (("ascentwind", "from ascentwind.runners.cli.entry import main; main()"),):
        (programs / name).write_text(f"#!{sys.executable}\n{code}\n", encoding="utf-8")
    for program in programs.iterdir():
        program.chmod(0o755)
    place = tmp_path / "place"
    place.mkdir()
    shutil.copytree(ROOT / "examples", place / "examples")
    (place / "docs").mkdir()
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.chdir(place)
    return place


PIP = """
    import re, sys
    from importlib.metadata import metadata
    known = metadata("ascentwind").get_all("Provides-Extra")
    for extra in re.findall(r"ascentwind\\[(\\w+)\\]", " ".join(sys.argv)):
        assert extra in known, f"there is no extra {extra}"
    assert sys.argv[1] == "install"
"""


RUN = [p for p in PAGES if p.name not in WALKED and any(b.kind in ("sh", "python") for b in blocks_of(p))]


def run(block: Block, names: dict) -> None:
    if block.kind == "sh":
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", block.text], capture_output=True, text=True, check=False,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
        assert done.returncode == 0, (
            f"{block.page.name}, line {block.line}:\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
        )
    elif block.kind == "python":
        exec(compile("\n" * (block.line - 1) + block.text, str(block.page), "exec"), names)


@pytest.mark.parametrize("page", RUN, ids=lambda p: p.name)
def test_a_page_runs_as_it_stands(page, folder, cache):
    for make in FILES.get(page.name, ()):
        make(folder)
    names: dict = {"__name__": "page"}
    exec(textwrap.dedent(KNOWN.get(page.name, "")), names)
    ran = [block for block in blocks_of(page) if block.why_not is None and block.kind in ("sh", "python")]
    for block in ran:
        run(block, names)
    assert len(ran) > 0 or page.name == "construction.md"


def test_what_does_not_run_is_found(folder, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "```python\nno_such_name\n```\n\n```sh\nascentwind runn\n```\n\n```sh\npip install 'ascentwind[repport]'\n```\n"
    )
    python, command, pip = blocks_of(page)
    with pytest.raises(NameError):
        run(python, {})
    for block in (command, pip):
        with pytest.raises(AssertionError, match="page.md, line"):
            run(block, {})


def test_what_pages_leave_to_readers_is_of_pages_that_are_there():
    assert {*KNOWN, *FILES} <= {page.name for page in PAGES}
