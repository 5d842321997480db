"""The cache of compiled code when things go wrong: full, read-only, left half by a kill, wrong, odd compilers."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import time
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from filelock import FileLock
from typer.testing import CliRunner

from ascentwind.codegen.ensemble.compiled import compiled_ensemble
from ascentwind.codegen.sweep.compiled import compiled_sweep
from ascentwind.codegen.system.executable import executable_system
from ascentwind.codegen.toolchain import cache as cache_module
from ascentwind.codegen.toolchain import library as library_module
from ascentwind.codegen.toolchain.cache import CacheError, cache_contents, cache_folder, clean_cache, remove_leftovers
from ascentwind.codegen.toolchain.compiler import CompilerError, find_compiler, run_program
from ascentwind.codegen.toolchain.library import InterpreterWarning
from ascentwind.model import define_system
from ascentwind.runners import Study
from ascentwind.runners.cli.app import app
from ascentwind.runners.cli.doctor import diagnose
from ascentwind.runners.present.files import prepare_folder

VARIANCE = 0.5 * (1 - np.exp(-2.0))  # of x' = -x + n at 1 s


def lag(name: str = "lag"):
    t, x, n, u = (ca.SX.sym(s) for s in ("t", "x", "n", "u"))
    return define_system(
        name, time=t, states={"x": (x, -x + n + u)}, noises={"n": n}, inputs={"u": (u, 1.0)}, outputs={"x": x}
    )


def variance(study: Study, **options) -> float:
    return float(study.response_statistics([1.0], **options).variance.values[0, 0, 0])


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv("ASCENTWIND_CACHE", str(folder))
    monkeypatch.setattr(library_module, "_said_once", set())
    return folder


def shell_compiler(tmp_path: Path, monkeypatch, body: str) -> None:
    script = tmp_path / "cc.sh"
    script.write_text(f'#!/bin/sh\ncase "$*" in *--version*) echo one 1; exit;; *-E*) exit 0;; esac\n{body}\n')
    script.chmod(0o755)
    monkeypatch.setenv("CC", str(script))


# full disk


@pytest.mark.parametrize("where", ["lock", "work", "compiler"])
def test_full_disk_falls_back_to_the_interpreter(own_cache, tmp_path, monkeypatch, where):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    if where == "compiler":
        shell_compiler(tmp_path, monkeypatch, "echo 'fatal error: error writing: No space left on device' >&2; exit 1")
    else:
        monkeypatch.setattr(cache_module, *{"lock": ("FileLock", full), "work": ("_install", full)}[where])
    with pytest.warns(InterpreterWarning, match=r"compiled code is not used: .*(No space|is full)"):
        study = Study.from_system(lag())
    assert variance(study) == pytest.approx(VARIANCE, rel=1e-6)


def test_disk_that_fills_up_before_the_sweep_leaves_cvodes(own_cache, monkeypatch):
    study = Study.from_system(lag("filling"))

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(cache_module, "_install", full)
    with pytest.warns(InterpreterWarning, match="CVODES takes the place of the sweep"):
        found = study.response_statistics([1.0])
    assert found.attrs["engine"] == "cvodes"
    assert found.variance.values[0, 0, 0] == pytest.approx(VARIANCE, rel=1e-6)
    with pytest.raises(CacheError, match="No space left"):
        study.response_statistics([1.0], engine="sweep")


# read-only


def test_read_only_cache_that_holds_all_is_used(own_cache, monkeypatch):
    assert variance(Study.from_system(lag())) == pytest.approx(VARIANCE, rel=1e-6)
    before = sorted((p.name, p.stat().st_mtime_ns) for p in own_cache.iterdir())

    def refuse(*_, **__):
        raise PermissionError(errno.EROFS, os.strerror(errno.EROFS))

    for name in ("FileLock", "_install", "_report_change"):
        monkeypatch.setattr(cache_module, name, refuse)
    own_cache.chmod(0o500)
    try:
        again = Study.from_system(lag())
        assert again.executable.code == "compiled"
        assert again.response_statistics([1.0]).attrs["engine"] == "sweep"
        assert sorted((p.name, p.stat().st_mtime_ns) for p in own_cache.iterdir()) == before
        with pytest.warns(InterpreterWarning, match="Read-only"):
            assert executable_system(lag("another")).code == "interpreter"
    finally:
        own_cache.chmod(0o700)


# odd compilers


@pytest.mark.parametrize(
    ("command", "text"),
    [
        ("'", "quotes that do not match"),
        ('cc "', "quotes"),
        ("''", "no such program"),
        ("no-such-cc -x", "no such program"),
    ],
)
def test_odd_compiler_is_named(own_cache, monkeypatch, command, text):
    monkeypatch.setenv("CC", command)
    with pytest.raises(CompilerError, match=text):
        find_compiler()
    line = next(f for f in diagnose() if f.what == "C compiler")
    assert not line.good


def test_file_that_is_no_program_is_named(own_cache, tmp_path, monkeypatch):
    (tmp_path / "cc").write_bytes(b"\x00\x01")
    (tmp_path / "cc").chmod(0o755)
    monkeypatch.setenv("CC", str(tmp_path / "cc"))
    with pytest.raises(CompilerError, match="cannot be run"):
        find_compiler()


def test_compiler_that_speaks_no_unicode(tmp_path, monkeypatch, own_cache):
    shell_compiler(tmp_path, monkeypatch, "printf '\\377\\376 bad' >&2; exit 4")
    with pytest.raises(CompilerError, match="code 4"):
        executable_system(lag())


def test_what_is_given_reaches_a_program():
    done = run_program([sys.executable, "-c", "import sys; print(sys.stdin.read() * 2)"], "ab")
    assert (done.returncode, done.stdout) == (0, "abab\n")


# left behind by a kill


def killed_process() -> int:
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_what_a_kill_left_in_the_cache_is_removed(own_cache):
    executable_system(lag())
    left = [own_cache / f"gone-1{suffix}" for suffix in (".abc.work", ".lock", ".damaged-17", ".wrong-18")]
    left.append(own_cache / "gone.structure.19")
    held, new = own_cache / "held.lock", own_cache / "new-2.xyz.work"
    for path in (*left, held, new):
        path.mkdir() if path.suffix == ".work" else path.write_text("")
    (left[0] / "system.c").write_text("half")
    long_ago = time.time() - 7200
    for path in (*left, held):
        os.utime(path, (long_ago, long_ago))
    kept = {p.name for p in own_cache.iterdir()} - {p.name for p in left}
    with FileLock(held):
        os.utime(held, (long_ago, long_ago))
        assert remove_leftovers(own_cache) == len(left)
    assert {p.name for p in own_cache.iterdir()} == kept
    library = executable_system(lag()).shared_library
    assert library is not None and not library.fresh


def test_compiling_removes_what_is_left(own_cache):
    cache_folder()
    left = own_cache / "gone-1.abc.work"
    left.mkdir()
    long_ago = time.time() - 7200
    os.utime(left, (long_ago, long_ago))
    executable_system(lag())
    assert not left.exists()


def test_cache_is_shown_and_cleaned(own_cache):
    executable_system(lag())
    held = cache_contents(own_cache)
    assert held.libraries == 1
    assert held.size == sum(p.stat().st_size for p in own_cache.iterdir())
    shown = CliRunner().invoke(app, ["cache"])
    assert "1 compiled libraries" in " ".join(shown.output.split())
    assert cache_contents(own_cache).libraries == 1
    with FileLock(own_cache / "busy.lock"):
        (own_cache / "busy.abc.work").mkdir()
        cleaned = CliRunner().invoke(app, ["cache", "--clean"])
        assert "0 compiled libraries" in " ".join(cleaned.output.split())
        assert sorted(p.name for p in own_cache.iterdir()) == ["busy.abc.work", "busy.lock"]
    assert clean_cache(own_cache) == 2
    library = executable_system(lag()).shared_library
    assert library is not None and library.fresh


def test_what_a_kill_left_in_results_is_removed(tmp_path):
    mine = tmp_path / f".statistics.{os.getpid()}.unfinished.nc"
    gone = tmp_path / f".statistics.{killed_process()}.unfinished.nc"
    others = [tmp_path / name for name in (".notes.2024.md", ".lock", "statistics.nc")]
    for path in (mine, gone, *others):
        path.write_text("")
    prepare_folder(tmp_path)
    assert sorted(tmp_path.iterdir()) == sorted([mine, *others])


def test_doctor_names_the_default_engine(own_cache, monkeypatch):
    def engine() -> str:
        return next(f.found for f in diagnose() if f.what == "default engine")

    study = Study.from_system(lag())
    assert engine().startswith(study.response_statistics([1.0]).attrs["engine"])
    monkeypatch.setenv("CC", "")
    with pytest.warns(InterpreterWarning):
        interpreted = Study.from_system(lag())
    assert engine().lower().startswith(interpreted.response_statistics([1.0]).attrs["engine"])


# numbers of every library


@pytest.mark.parametrize(
    ("make", "change"),
    [
        (compiled_sweep, ("x[i] + h * ", "x[i] + 1.0001 * h * ")),
        (compiled_sweep, ("next[n] = x[n] + h * slope", "next[n] = x[n] + 1.0001 * h * slope")),
        (compiled_sweep, ("node_weight[0] * g", "1.0001 * node_weight[0] * g")),
        (compiled_ensemble, ("6.283185307179586", "6.283185307")),
    ],
)
def test_library_with_wrong_numbers_is_set_aside(own_cache, tmp_path, monkeypatch, make, change):
    """A library that computes something else, its digest in order: found whether it was made now or before."""
    old, new = change
    wrapper = tmp_path / "wrongcc"
    wrapper.write_text(
        f"#!{sys.executable}\nimport pathlib, subprocess, sys\n"
        "for name in sys.argv[1:]:\n"
        "    path = pathlib.Path(name)\n"
        f"    if name.endswith('.c') and {old!r} in (text := path.read_text()):\n"
        f"        path.write_text(text.replace({old!r}, {new!r}))\n"
        "        pathlib.Path(__file__).with_name('changed').touch()\n"
        "sys.exit(subprocess.run(['cc', *sys.argv[1:]]).returncode)\n"
    )
    wrapper.chmod(0o755)
    monkeypatch.setenv("CC", str(wrapper))
    with pytest.raises(CacheError, match="differs from the interpreter"):
        make(lag())
    assert (tmp_path / "changed").exists()
    assert list(own_cache.glob("*.wrong-*"))
    assert not list(own_cache.glob("*.so"))


@pytest.mark.slow
def test_library_found_in_the_cache_is_compared_too(own_cache):
    """Right bytes of the wrong system under another's name."""
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    slower = define_system("lag", time=t, states={"x": (x, -0.999 * x + n)}, noises={"n": n}, outputs={"x": x})
    good, bad = (compiled_sweep(system).shared_library.path for system in (lag(), slower))
    assert good != bad
    for suffix in (".so", ".sha256"):
        bad.with_suffix(suffix).replace(good.with_suffix(suffix))
    # another process, which has loaded neither
    program = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "from test_cache import compiled_sweep, lag; print(compiled_sweep(lag()).shared_library.fresh)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert "differs from the interpreter" in done.stderr
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"
