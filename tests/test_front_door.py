"""The front door: every public name at one address, errors that travel, and nothing imported before it is needed."""

from __future__ import annotations

import ast
import copy
import importlib
import pickle
import pkgutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import ascentwind
from ascentwind import errors
from ascentwind.runners.solvers.sweep import SweepResult

STUBS = {
    "ascentwind": Path(ascentwind.__file__).with_suffix(".pyi"),
    "ascentwind.errors": Path(errors.__file__).with_suffix(".pyi"),
    "ascentwind.model": Path(ascentwind.__file__).parent / "model" / "__init__.pyi",
    "ascentwind.runners": Path(ascentwind.__file__).parent / "runners" / "__init__.pyi",
}
HEAVY = ("casadi", "matplotlib", "numpy", "pandas", "scipy", "xarray")
EXAMPLES = {
    "NoVehicleError": lambda: errors.NoVehicleError("another wind", "lag"),
    "BatchError": lambda: errors.BatchError({1: errors.IntegrationError("too fast")}, {0: sweep_result()}),
    "CompilerError": lambda: errors.CompilerError(["cc", "-O3"], 1, "no such file"),
    "DataError": lambda: errors.DataError("is odd", file=Path("vehicle.toml"), column="mass", row=3, time=1.5),
    "ExportError": lambda: errors.ExportError("has no end", time=3.0),
    "GroupedFactorError": lambda: errors.GroupedFactorError("aerodynamics"),
    "InfeasibleDesignError": lambda: errors.InfeasibleDesignError("damping", 0.1, 0.05, {"gain": 1.0}),
    "LimitError": lambda: errors.LimitError("is no limit", file=Path("limit.csv"), column="bending_moment"),
    "MissingLibraryError": lambda: errors.MissingLibraryError("is GRIB", file=Path("era5.grib")),
    "MissingSymPyError": lambda: errors.MissingSymPyError(),
    "NotAParameterError": lambda: errors.NotAParameterError("mass"),
    "NotPositiveSemidefiniteError": lambda: errors.NotPositiveSemidefiniteError("has a negative root", row=2),
    "PlanesError": lambda: errors.PlanesError("a design wind", "as504"),
    "ResultsFolderError": lambda: errors.ResultsFolderError("holds no results", file=Path("found")),
    "SeveralDataErrors": lambda: errors.SeveralDataErrors([errors.DataError("is odd", row=3), errors.DataError("too")]),
    "SoundingError": lambda: errors.SoundingError("is odd", file=Path("s.csv"), row=3, sounding="7", altitude=500.0),
    "StepBudgetError": lambda: errors.StepBudgetError(10, "t = 12 s", time=12.0, fastest="-900, slosh 1"),
    "StructuralParameterError": lambda: errors.StructuralParameterError("modes"),
    "TableParameterError": lambda: errors.TableParameterError("thrust"),
    "UnknownNameError": lambda: errors.UnknownNameError("response", "momnt", ["moment"]),
}


def sweep_result() -> SweepResult:
    return SweepResult(np.ones(1), np.ones((1, 1, 1, 1)), np.ones((1, 1)), np.zeros((1, 1, 1)), {"steps": 3})


def stub_names(stub: Path) -> dict[str, str]:
    """Return the names that a stub offers, and the module each is taken from; a module itself has none."""
    return {
        alias.asname or alias.name: node.module or ""
        for node in ast.parse(stub.read_text()).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def all_classes() -> set[type]:
    """Return every public error and warning class of the package, found by walking its modules."""
    for module in pkgutil.walk_packages(ascentwind.__path__, "ascentwind."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)

    def below(base: type) -> set[type]:
        return {base}.union(*(below(sub) for sub in base.__subclasses__()))

    found = below(errors.AscentwindError) | below(errors.AscentwindWarning)
    return {c for c in found if c.__module__.startswith("ascentwind.") and not c.__name__.startswith("_")}


@pytest.mark.parametrize("name", STUBS)
def test_stubs_say_what_is_there(name):
    module, stub = importlib.import_module(name), stub_names(STUBS[name])
    package = name if name != "ascentwind.errors" else "ascentwind"
    assert sorted(stub) == dir(module)
    for public, source in stub.items():
        found = getattr(module, public)
        home = importlib.import_module(f"{package}.{source}" if source else f"{package}.{public}")
        assert found is (getattr(home, public) if source else home)


def test_a_misspelt_name_is_no_attribute():
    with pytest.raises(AttributeError):
        getattr(ascentwind, "Stud" + "dy")


def test_every_error_class_has_the_public_address():
    found = all_classes()
    assert {c.__name__ for c in found} == set(dir(errors))
    assert all(getattr(errors, c.__name__) is c for c in found)
    assert len({c.__name__ for c in found}) == len(found), "two classes share a name"


def attributes(error: BaseException) -> dict[str, object]:
    """Return what can be compared: errors and results inside by their text."""
    return {key: repr(value) for key, value in vars(error).items()}


@pytest.mark.parametrize("name", dir(errors))
@pytest.mark.parametrize("travel", [lambda e: pickle.loads(pickle.dumps(e)), copy.copy], ids=["pickle", "copy"])
def test_errors_travel(name, travel):
    error = EXAMPLES.get(name, lambda: getattr(errors, name)("says where, why and what to do"))()
    error.add_note("seen on a worker")
    found = travel(error)
    assert type(found) is type(error)
    assert str(found) == str(error)
    assert found.args == error.args
    assert attributes(found) == attributes(error)


def test_classes_with_arguments_of_their_own_are_among_the_examples():
    own = {
        name
        for name in dir(errors)
        if any("__init__" in vars(c) for c in getattr(errors, name).__mro__ if c.__module__.startswith("ascentwind."))
    }
    assert own == set(EXAMPLES)


def modules_after(*program: str) -> set[str]:
    """Return the modules that a fresh interpreter has when a command line ends."""
    report = "import atexit, sys; atexit.register(lambda: print(*sys.modules, sep='\\n', file=sys.stderr)); "
    run = "import sys, runpy; sys.argv[1:] = {!r}; runpy.run_module('ascentwind', run_name='__main__')"
    code = report + (run.format(list(program)) if program else "import ascentwind")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=False)
    assert "Traceback" not in done.stderr
    return set(done.stderr.splitlines())


@pytest.mark.parametrize("vehicle", ["as504", "falcon1"])
def test_a_study_is_loaded_without_what_draws_labels_and_integrates(vehicle):
    code = f"import sys; from ascentwind import Study; Study.load('{vehicle}', compile=False); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300)
    loaded = set(done.stdout.split())
    assert not {"matplotlib", "xarray", "pandas", "dask", "distributed"} & loaded
    assert not {"scipy.special", "scipy.linalg", "scipy.integrate", "scipy.interpolate", "scipy.optimize"} & loaded


@pytest.mark.parametrize(
    "program",
    [
        (),
        ("--help",),
        ("--version",),
        ("run", "--help"),
        ("wind", "--help"),
        ("run",),
        ("rnu",),
        ("run", "x", "--tmes"),
    ],
    ids=lambda p: " ".join(p) or "import",
)
def test_help_and_usage_errors_wait_for_nothing(program):
    loaded = modules_after(*program)
    assert "ascentwind" in loaded
    assert loaded.isdisjoint(HEAVY)
