"""A stranger's first walk, with nothing but the built wheel and the pages: what they say is run as they say it.

python tests/first_walk.py WHEEL FOLDER

The folder is empty before. Start in five minutes (install, run, report), the first lines of Python and a system of
one's own are those of docs/index.md, a vehicle of one's own those of docs/bring-your-own-vehicle.md. The wheel stands
for what the page takes from the package index; nothing else is put in.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent / "support"))
from page_blocks import ROOT, WALKED, Block, blocks_of

INSTALL = '"ascentwind[report]"'
ACTIVATE = ". .venv/bin/activate"


def environment(folder: Path) -> dict[str, str]:
    """Return a clean environment: the system's programs, this Python before them, and a home of its own."""
    home = folder / "home"
    home.mkdir()
    path = os.pathsep.join([str(Path(sys.executable).parent), "/usr/local/bin", "/usr/bin", "/bin"])
    kept = {name: os.environ[name] for name in os.environ if name.startswith(("PIP_", "SSL_", "HTTP", "NO_PROXY"))}
    for settings in (".config/pip/pip.conf", ".pip/pip.conf"):  # where packages come from here
        if (Path.home() / settings).is_file():
            kept.setdefault("PIP_CONFIG_FILE", str(Path.home() / settings))
    return {"PATH": path, "HOME": str(home), "LANG": "C.UTF-8", **kept}


def steps(block: Block, wheel: Path) -> str:
    """Return what a shell runs for a block."""
    if block.kind == "python":
        return f"{ACTIVATE}\npython - <<'ENDOFBLOCK'\n{block.text}ENDOFBLOCK\n"
    text = block.text.replace(INSTALL, f'"{wheel}[report]"')
    return text if block.page.name == "index.md" else f"{ACTIVATE}\n{text}"


def walk(wheel: Path, folder: Path) -> None:
    """Run the blocks in order; the first that fails ends the walk with its page and line."""
    place = folder / "empty"
    place.mkdir()
    surroundings = environment(folder)
    index, vehicle = (blocks_of(ROOT / "docs" / name) for name in WALKED)
    if INSTALL not in index[0].text:
        sys.exit(f"docs/index.md does not begin with an installation of {INSTALL}")
    for block in (*index, *vehicle):
        left_out = block.why_not is not None and block is not index[0]  # the installation is run here alone
        if block.kind not in ("sh", "python") or left_out:
            continue
        print(f"-- {block.page.name}, line {block.line}", flush=True)
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", steps(block, wheel)],
            cwd=place, env=surroundings, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            sys.exit(f"{done.stdout}\n{block.page.name}, line {block.line}: exit code {done.returncode}")
    missing = [
        name
        for name in ("as504-results/report.html", "my_rocket-results/statistics.nc")
        if not (place / name).is_file()
    ]
    if missing:
        sys.exit(f"the walk ends without {missing}")


if __name__ == "__main__":
    walk(Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve())
