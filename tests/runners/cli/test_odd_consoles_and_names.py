"""Consoles without sigma, folders and titles that look like markup or mathematics, and folders for results."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from matplotlib.figure import Figure

from ascentwind.runners.cli.app import main
from ascentwind.runners.cli.terminal import results_folder
from ascentwind.runners.present.style import write_figure


@pytest.fixture
def command(monkeypatch, tmp_path, capsys):
    """Run the command line in a folder of its own; return exit code and what it printed."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["ascentwind", *arguments])
        with pytest.raises(SystemExit) as stop:
            main()
        printed = capsys.readouterr()
        assert "Traceback" not in printed.err
        return int(stop.value.code or 0), printed.out, printed.err

    return run


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["cp1252", "latin-1", "ascii", "utf-8"])
def test_consoles_without_sigma(encoding, tmp_path, cache):
    """The peaks of a run name sigma and plus-minus; no console is too old for them."""
    environment = os.environ | {"PYTHONIOENCODING": encoding, "ASCENTWIND_CACHE": str(cache), "COLUMNS": "160"}
    program = "from ascentwind.runners.cli.app import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", program, "run", "falcon1", "--times", "65", "--out", "found"],
        cwd=tmp_path, env=environment, capture_output=True, check=False,
    )  # fmt: skip
    printed = done.stdout.decode(encoding)
    assert done.returncode == 0, done.stderr
    assert ("σ" if encoding == "utf-8" else "sigma") in printed


@pytest.mark.slow
def test_folder_that_looks_like_markup(command, vehicle_folder, tmp_path):
    folder = tmp_path / "[/red][bold]"
    folder.parent.mkdir()
    vehicle_folder.rename(folder)
    code, printed, _ = command("run", str(folder), "--times", "60", "--out", "[/red]")
    assert code == 0
    assert "files in [/red]: statistics.nc" in printed
    code, _, told = command("run", "[/blue]")
    assert code == 2 and "'[/blue]'" in told
    toml = folder / "vehicle.toml"
    toml.write_text(toml.read_text().replace("start_time_s", "start_tim_s"))
    code, _, told = command("run", str(folder))
    assert code == 2 and "[/red][bold]" in told.replace("\n", "")


TITLES = ["cost $5 and $\\frac$", "$", "$$", "a $b$ c", "\\$", "$x_{$", "100 % & <tag>", "line\nbreak"]


@pytest.mark.parametrize("title", TITLES)
def test_titles_are_no_mathematics(title, tmp_path):
    figure = Figure()
    axes = figure.subplots()
    axes.loglog([1e-3, 1.0], [1e-6, 1.0], label=title)
    axes.set(title=title, xlabel=title, ylabel=title)
    axes.annotate(title, (0.1, 0.1))
    axes.legend(title=title)
    figure.suptitle(title)
    bars = figure.add_subplot()
    bars.barh([0, 1], [1, 2])
    bars.set_yticks([0, 1], labels=[title, "other"])
    written = write_figure(figure, tmp_path, "../a/b")
    assert all(path.parent == tmp_path and path.stat().st_size > 0 for path in written)


def test_results_of_the_folder_one_stands_in(monkeypatch, tmp_path):
    (tmp_path / "rocket").mkdir()
    monkeypatch.chdir(tmp_path / "rocket")
    assert [results_folder(name, "results").name for name in (".", "../rocket", "as504", "/")] == [
        "rocket-results", "rocket-results", "as504-results", "vehicle-results",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "as505"),
        ("sensitivity", "as505"),
        ("tolerance", "as505"),
        ("verify", "as505", "--out", "found"),
        ("mean", "as505", "--out", "found"),
        ("design", "as505"),
        ("run", "as504", "--times", "5000"),
        ("run", "as504", "--set", "bending.0.dampng=1"),
        ("run", "as504", "--set", f"title={'[' * 3000}"),
        ("run", "as504", "--set", f"start_time_s={'9' * 5000}"),
    ],
)
def test_nothing_is_left_by_a_command_mistyped(command, arguments, tmp_path):
    code, _, told = command(*arguments)
    assert code == 2 and "error:" in told
    assert not list(tmp_path.iterdir())
