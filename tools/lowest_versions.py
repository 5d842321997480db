"""Runs the main job with the lowest versions of dependencies that pyproject.toml promises, in a fresh environment.

python tools/lowest_versions.py [FOLDER]

Without a C compiler, as on a machine that has none: the wheel alone must do. Exit code 1 where a version does not exist
or the job does not end with the numbers of the newest versions.
"""

from __future__ import annotations

import csv
import os
import re
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).parents[1]
JOB = ("run", "as504", "--times", "70,75", "--out", "found")
PEAK = 4.896e6  # N m, sigma of the bending moment at 75 s, as README's table says by its variance


def lowest(requirement: str) -> str:
    """Return a requirement of its lowest version alone: 'numpy>=2.0' becomes 'numpy==2.0'."""
    name, version = re.fullmatch(r"([\w.-]+)>=([\d.]+).*", requirement).groups()  # pyright: ignore
    return f"{name}=={version}"


def main() -> int:
    dependencies = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp())
    venv.create(folder / "venv", with_pip=True)
    python = folder / "venv" / ("Scripts" if os.name == "nt" else "bin") / "python"
    pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, "--only-binary", ":all:", *map(lowest, dependencies)], check=True)
    subprocess.run([*pip, "--no-deps", str(ROOT)], check=True)
    clean = {"PATH": str(folder), "HOME": str(folder), "CC": "", "ASCENTWIND_CACHE": str(folder / "cache")}
    done = subprocess.run([str(python), "-m", "ascentwind", *JOB], cwd=folder, env=clean, check=False)
    if done.returncode:
        return 1
    rows = list(csv.DictReader((folder / "found" / "statistics.csv").open()))
    wanted = "75", "bending_moment", "combined"
    (sigma,) = (float(r["std"]) for r in rows if (r["time_s"], r["response"], r["source"]) == wanted)
    print(f"lowest versions: {', '.join(map(lowest, dependencies))}\nsigma {sigma:.6g} N m")
    return int(abs(sigma / PEAK - 1) > 1e-3)


if __name__ == "__main__":
    sys.exit(main())
