"""Progress: one bar, on a terminal or in a cell of a notebook, and how long it will still take."""

from __future__ import annotations

import builtins
import io
import sys
import threading
import time
import types
import warnings
from concurrent.futures import ThreadPoolExecutor

import pytest
from lag import dispersion, lag, normal
from rich.progress import TaskID

import ascentwind as aw
from ascentwind import run_parameter_study, synthesise
from ascentwind.model.wind.range_reference import shipped_statistics
from ascentwind.runners.present import bars, progress
from ascentwind.runners.present.bars import Bar, NotebookBar, terminal_bar, time_left
from ascentwind.runners.present.progress import each, opened, show_progress, steps
from ascentwind.runners.present.terminal import Terminal, console
from ascentwind.runners.solvers.least_squares import FitOptions


class Screen(io.StringIO):
    """What a terminal would be, or what notebooks and pipes are."""

    def __init__(self, terminal: bool):
        super().__init__()
        self.terminal = terminal

    def isatty(self) -> bool:
        return self.terminal


def shown(terminal: bool) -> str:
    screen = Screen(terminal)
    with Terminal(file=screen).status("computing"):
        pass
    return screen.getvalue().strip()


def test_nothing_moves_where_no_terminal_is(monkeypatch):
    for name in ("TERM", "NO_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("FORCE_COLOR", "1")  # as the cells of notebooks have it
    assert shown(terminal=False) == ""
    assert "computing" in shown(terminal=True)


def test_bars_without_a_terminal_print_nothing(monkeypatch, capsys):
    monkeypatch.setenv("FORCE_COLOR", "1")
    with opened(terminal_bar(console)), steps("members", 2) as line:
        line.done()
    assert capsys.readouterr().out.strip() == ""
    assert not console.is_terminal


def test_bars_say_what_is_done_and_how_long_it_will_take(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    screen = Screen(terminal=True)
    with opened(terminal_bar(Terminal(file=screen, width=120))) as _, steps("members", 4) as line:
        line.done()
        progress._open.get().refresh()  # pyright: ignore
    assert "members" in screen.getvalue()
    assert "1/4" in screen.getvalue()
    assert "left 0:00:0" in screen.getvalue()


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def timed():
    clock = Clock()
    return Bar(console=Terminal(file=io.StringIO()), get_time=clock, auto_refresh=False), clock


def test_time_left_is_by_the_mean_step(timed):
    bar, clock = timed
    task = bar.add_task("steps", total=10)
    assert time_left(bar.tasks[0]) is None  # nothing is known before the first step
    clock.now = 50.0  # a step of more than the half minute that rich remembers
    bar.update(task, advance=1)
    assert time_left(bar.tasks[0]) == pytest.approx(450.0)
    clock.now = 60.0
    assert time_left(bar.tasks[0]) == pytest.approx(440.0)
    clock.now = 70.0
    bar.update(task, advance=4)
    assert time_left(bar.tasks[0]) == pytest.approx(70.0)


def test_what_was_stored_before_says_nothing_of_the_time(timed):
    bar, clock = timed
    task = bar.add_task("members", total=None)
    bar.update(task, completed=90, total=100)
    assert time_left(bar.tasks[0]) is None
    clock.now = 10.0
    bar.update(task, completed=95)
    assert time_left(bar.tasks[0]) == pytest.approx(10.0)


def test_what_has_a_limit_says_how_long_at_most(timed):
    bar, clock = timed
    bar.add_task("fit", total=60.0, limit=True)
    clock.now = 25.0
    assert time_left(bar.tasks[0]) == pytest.approx(35.0)
    assert str(bars.TimeLeft().render(bar.tasks[0])) == "at most 0:00:35"


class Recorded(Bar):
    """A bar that keeps what each line said last."""

    def __init__(self):
        super().__init__(console=Terminal(file=io.StringIO()), auto_refresh=False)
        self.said: list[tuple[str, float, float | None]] = []

    def remove_task(self, task_id: TaskID) -> None:
        task = next(task for task in self.tasks if task.id == task_id)
        self.said.append((task.description, task.completed, task.total))
        super().remove_task(task_id)


def told(call) -> list[tuple[str, float, float | None]]:
    bar = Recorded()
    with opened(bar):
        call()
    assert bar.tasks == []
    return bar.said


CALLS = {
    "code of lag": lambda folder: lag(),
    "all end times in one sweep": lambda folder: lag().response_statistics([1.0, 2.0]),
    "end times by CVODES": lambda folder: lag().response_statistics([1.0, 2.0], engine="cvodes"),
    "end times by the covariance": lambda folder: lag().response_statistics([1.0, 2.0], engine="covariance"),
    "20 flights": lambda folder: lag().response_statistics([1.0], engine=aw.Ensemble(runs=20)),
    "sensitivities": lambda folder: lag().sensitivities(None, [1.0, 2.0]),
    "second derivatives": lambda folder: lag().second_derivatives("x", 2.0, ["tau", "gain"]),
    "parameters by differences": lambda folder: lag().check_sensitivity("x", 2.0),
    "level of x": lambda folder: lag().flight_load("x", (1.0, 2.0), (1e-2, 1e-3), draws=100).levels,
    "matrices": lambda folder: lag().matrix_grid([1.0, 2.0]),
    "members": lambda folder: run_parameter_study(dispersion(20, normal("tau", 0.1)), folder, study=lag()),
    "state-space for": lambda folder: synthesise(shipped_statistics(top=6000.0), options=FitOptions(max_evaluations=3)),
}


@pytest.mark.parametrize("line", CALLS)
def test_library_calls_say_their_steps(line, capsys, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = [said for said in told(lambda: CALLS[line](tmp_path)) if said[0].startswith(line)]
    assert found, line
    for text, done, total in found:
        if line.startswith("state-space"):
            assert "evaluations" in text
        elif total is not None:
            assert done == total, text
    assert capsys.readouterr() == ("", "")


def test_scripts_are_silent(capsys, monkeypatch):
    monkeypatch.setattr(bars, "NotebookBar", None)  # whoever made one would fail
    monkeypatch.setattr(bars, "terminal_bar", None)
    with steps("members", 2) as line:
        assert progress._open.get() is None
        line.done()
        line.reached(2, 2, "members")
    assert list(each([1, 2], "members")) == [1, 2]
    assert capsys.readouterr() == ("", "")


class ZMQInteractiveShell:
    """What rich takes for a notebook."""


class Cell:
    """The outputs of a cell, of which one is rewritten."""

    def __init__(self):
        self.seen: list[dict[str, str]] = []

    def display(self, bundle, raw, display_id):
        assert raw
        assert display_id
        self.seen.append(bundle)
        return self

    def update(self, bundle, raw):
        assert raw
        self.seen.append(bundle)


@pytest.fixture
def cell(monkeypatch):
    made = Cell()
    monkeypatch.setitem(sys.modules, "ipykernel", types.ModuleType("ipykernel"))
    module = types.ModuleType("IPython.display")
    module.display = made.display  # pyright: ignore[reportAttributeAccessIssue]
    monkeypatch.setitem(sys.modules, "IPython", types.ModuleType("IPython"))
    monkeypatch.setitem(sys.modules, "IPython.display", module)
    monkeypatch.setattr(builtins, "get_ipython", lambda: ZMQInteractiveShell(), raising=False)
    monkeypatch.setattr(bars, "AFTER", 0.02)
    monkeypatch.setattr(bars, "EVERY", 0.02)
    return made


def until(seen: list, text: str) -> None:
    for _ in range(500):
        if any(text in bundle["text/plain"] for bundle in seen):
            return
        time.sleep(0.01)
    raise AssertionError(f"'{text}' was never shown: {seen}")


def test_a_cell_shows_what_is_done_and_is_emptied(cell, capsys):
    with steps("outer <members>", 4) as line:
        line.done()
        until(cell.seen, "1/4")
        with steps("inner"):
            until(cell.seen, "inner")
    texts = [bundle["text/plain"] for bundle in cell.seen]
    assert "outer <members>" in texts[0]
    assert any("left 0:00:0" in text for text in texts)
    assert any(text.count("\n") == 1 for text in texts)  # both lines in one output
    assert "<pre>outer &lt;members&gt;" in cell.seen[0]["text/html"]
    assert cell.seen[-1] == {"text/plain": "", "text/html": ""}
    assert max(len(str(bundle)) for bundle in cell.seen) < 2000
    assert capsys.readouterr() == ("", "")


def test_what_is_quick_shows_nothing_in_a_cell(cell, monkeypatch):
    monkeypatch.setattr(bars, "AFTER", 60.0)
    began = time.monotonic()
    with steps("members", 2):
        pass
    assert cell.seen == []
    assert time.monotonic() - began < 30.0  # nor is it waited for


def test_a_cell_that_fails_is_emptied_too(cell):
    with pytest.raises(ValueError, match="no"), steps("members", 2):
        until(cell.seen, "0/2")
        raise ValueError("no")
    assert cell.seen[-1]["text/plain"] == ""
    assert progress._open.get() is None


def test_threads_open_no_bar_of_their_own(cell):
    def work() -> bool:
        with steps("in a thread", 2):
            return progress._open.get() is None

    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(work).result()
    assert threading.active_count() >= 1
    assert cell.seen == []


def test_people_choose_whether_it_shows(cell, monkeypatch):
    try:
        show_progress(False)
        with steps("members", 2):
            assert progress._open.get() is None
        show_progress(None)
        with steps("members", 2):
            assert isinstance(progress._open.get(), NotebookBar)
        show_progress()
        monkeypatch.delattr(builtins, "get_ipython")
        screen = Screen(terminal=True)
        monkeypatch.setenv("TERM", "xterm")
        monkeypatch.setattr("ascentwind.runners.present.terminal.errors", Terminal(file=screen, width=100))
        with steps("members", 2) as line:
            line.done()
        assert "members" in screen.getvalue()
    finally:
        show_progress(None)


@pytest.mark.slow
def test_an_executed_notebook_shows_progress_and_stays_small(tmp_path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    shown: list[str] = []

    class Client(nbclient.NotebookClient):
        def process_message(self, msg, cell, cell_index):
            if "display" in msg["msg_type"]:
                shown.append(msg["content"]["data"]["text/plain"])
            return super().process_message(msg, cell, cell_index)

    code = (
        "import ascentwind as aw\nstudy = aw.Study.load('as504')",
        "found = study.second_derivatives('bending_moment', 75.0, study.system.parameter_names[:3])",
        "from ascentwind.runners.present.progress import each\nimport time\n"
        "for _ in each(range(4), 'members'): time.sleep(0.5)\nstudy",
    )
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in code])
    Client(book, timeout=300, kernel_name="python3").execute(cwd=str(tmp_path))
    assert any("second derivatives" in text and "/3" in text for text in shown)
    assert any("members" in text and "left 0:00:0" in text for text in shown)
    assert len(nbformat.writes(book)) < 20_000
    assert all("<pre>" not in str(cell.outputs) for cell in book.cells)  # emptied
    assert "Study of as504" in str(book.cells[-1].outputs)
