"""The C library of a case: its system with the numbers in force, examples, and the table that it must reach."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...codegen.export.source import Expected, ExportError, FlightCuts, MeasuredInput, library_files
from ...model.equations.vehicle_tables import MET_ALTITUDE
from ...model.errors import DirectNoiseError
from ...model.system.names import COMBINED, WIND
from ...model.system.switches import ROUNDINGS
from ..case.case import Case
from ..case.times import end_times, parse_times
from ..present.files import write_text
from ..solvers.sweep import LEAST_TOLERANCE, LONGEST_SEGMENT, MOST_SEGMENTS
from ..solvers.time_nodes import NEAR_START, SAME
from ..solvers.tolerances import LARGEST_TOLERANCE
from ..solvers.typical_sizes import misjudged, sizes_of_sweep
from ..statistics.engines import response_statistics
from ..statistics.results import ResponseStatistics
from ..statistics.sweep import Sweep

SAME_CODE, OTHER_CODE = 1e-9, 1e-4  # how far a library may be from the sweep's numbers, and from CVODES's
TIMES = 100  # of a flight whose vehicle names none
POINTS = 1000  # of the example of a measured wind
LIMIT = 1.25  # of the largest |mean| + 3 sigma: limits made up for the example


def c_library(case: Case, times: Sequence[float] | None = None) -> dict[str, str]:
    """Return the files of the C library of a case by name.

    Parameters
    ----------
    case : Case
    times : sequence of float, optional
        End times of the example, s; a vehicle's default times without it.

    Raises
    ------
    ExportError, TimeRangeError, ParameterValueError, IntegrationError
    """
    case.require_linear_mean("the C library")
    system, executable = case.system, case.with_means
    if not np.isfinite(system.end):
        raise ExportError(f"system '{system.name}' has no end, and its library needs one; give it a finite end")
    ends = np.array(case.checked_times(end_times(_default_times(case) if times is None else times)))
    finite = _finite_responses(case)
    statistics = response_statistics(case, ends.tolist(), responses=finite) if finite else None
    cuts = FlightCuts(
        times=ends,
        pulses=executable.pulses(system.end),
        sizes=_sizes(case, statistics, finite),
        constants={
            "same": SAME,
            "near_start": NEAR_START,
            "roundings": ROUNDINGS,
            "longest_segment": LONGEST_SEGMENT,
            "most_segments": MOST_SEGMENTS,
            "least_tolerance": LEAST_TOLERANCE,
            "largest_tolerance": LARGEST_TOLERANCE,
        },
        tolerance=Sweep().relative_tolerance,
    )
    expected = None if statistics is None else _expected(case, statistics, finite)
    return library_files(executable, cuts, version("ascentwind"), expected, _measured_wind(case, statistics))


def write_texts(texts: Mapping[str, str], folder: Path) -> list[Path]:
    """Write files into a folder that is there, each of them whole.

    Raises
    ------
    OutputFolderError
    """
    return [write_text(folder / name, text) for name, text in texts.items()]


def _default_times(case: Case) -> list[float]:
    if case.vehicle is not None:
        return parse_times(case.vehicle.file.default_times)
    start, end = case.system.start, case.system.end
    return np.linspace(start, end, TIMES + 1)[1:].tolist()


def _finite_responses(case: Case) -> list[str]:
    """Return the responses that no white noise reaches directly."""
    found = []
    for name in case.system.output_names:
        try:
            case.system.refuse_direct_noise([name])
        except DirectNoiseError:
            continue
        found.append(name)
    return found


def _sizes(case: Case, statistics: ResponseStatistics | None, names: list[str]) -> NDArray[np.float64]:
    """Return the typical sizes by which the sweep weighs errors in the end, as ``swept`` chooses them."""
    system = case.system
    sizes = sizes_of_sweep(case.with_means, system.end)
    if statistics is not None and system.sources:
        covariance = np.zeros((statistics.std.sizes["time"], len(system.sources), *(2 * (len(system.outputs),))))
        rows = [system.output_index(name) for name in names]
        std = statistics.std.sel(source=list(system.sources)).transpose("time", "source", "response")
        covariance[:, :, rows, rows] = std.values**2
        if misjudged(sizes, covariance):
            return sizes_of_sweep(case.with_means, system.end, trust=False)
    return sizes


def _expected(case: Case, statistics: ResponseStatistics, names: list[str]) -> Expected:
    system = case.system
    rows = [system.output_index(name) for name in names]
    std = statistics.std.sel(source=[*system.sources, COMBINED]).transpose("time", "response", "source").values
    sigma = np.full((std.shape[0], len(system.outputs), std.shape[2]), np.nan)
    mean = np.full(sigma.shape[:2], np.nan)
    sigma[:, rows] = std
    mean[:, rows] = statistics.mean.sel(source=COMBINED).transpose("time", "response").values
    same = statistics.attrs.get("engine") == Sweep.name
    return Expected(mean, sigma, SAME_CODE if same else OTHER_CODE)


def _measured_wind(case: Case, statistics: ResponseStatistics | None) -> MeasuredInput | None:
    """Return a vehicle's mean wind along its flight as an example of a wind that was measured."""
    if case.vehicle is None or WIND not in case.system.input_names or statistics is None:
        return None
    which = case.system.input_names.index(WIND)
    executable, system = case.with_means, case.system
    times = np.linspace(system.start, system.end, POINTS + 1)
    winds = [float(executable.matrices(t, system.start, system.end)["inputs"][which, 0]) for t in times]
    met = MET_ALTITUDE if MET_ALTITUDE in case.tables(system.start) else "altitude"
    altitudes = [case.tables(t)[met] for t in times]
    higher = [k for k, h in enumerate(altitudes) if not k or h > max(altitudes[:k])]
    combined = statistics.std.sel(source=COMBINED)
    peaks = (abs(statistics.mean.sel(source=COMBINED)) + 3 * combined).max("time")
    limits = {str(name): float(f"{LIMIT * peaks.sel(response=name).item():.3g}") for name in peaks["response"].values}
    return MeasuredInput(
        WIND, met, np.array(altitudes)[higher], np.array(winds)[higher], "m/s",
        {name: limit for name, limit in limits.items() if limit > 0},
    )  # fmt: skip
