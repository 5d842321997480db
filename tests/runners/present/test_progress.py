"""Progress: moves on a terminal alone, and says how long it will still take."""

from __future__ import annotations

import io

from rich.progress import TimeRemainingColumn

from ascentwind.runners.present.terminal import Terminal, console, progress_bar


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
    with progress_bar() as bar:
        bar.advance(bar.add_task("members", total=2))
    assert capsys.readouterr().out.strip() == ""
    assert not console.is_terminal


def test_bars_say_how_long_it_will_take():
    assert any(isinstance(column, TimeRemainingColumn) for column in progress_bar().columns)
