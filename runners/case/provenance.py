"""What a result was computed from, as attributes that travel with it."""

from __future__ import annotations

import hashlib
import platform
from importlib.metadata import version

import casadi as ca
import numpy as np

from .case import Case


def provenance(case: Case) -> dict[str, object]:
    """Return what a result was computed from: system, data hash, options, changed parameters and versions."""
    system, executable = case.system, case.executable
    nominal = np.array([p.value for p in system.parameters])
    changed = [
        f"{name} = {value:g}"
        for name, value, was in zip(system.parameter_names, executable.parameters, nominal, strict=True)
        if value != was
    ]
    attributes: dict[str, object] = {
        "system": system.name,
        "start_time_s": system.start,
        "structure": "; ".join(f"{k}: {v}" for k, v in system.structure.items()),
        "data_sha256": data_hash(case),
        "code_key": executable.shared_library.key if executable.shared_library else "interpreter",
        "changed_parameters": "; ".join(changed) or "none",
        "ascentwind": version("ascentwind"),
        "casadi": ca.CasadiMeta.version(),
        "numpy": np.__version__,
        "python": platform.python_version(),
    }
    if case.vehicle:
        attributes["title"] = case.vehicle.title
        if (samples := wind_samples(case)) is not None:
            attributes["wind_independent_samples"] = samples
        attributes["tables"] = "; ".join(f"{s.file.name}: {s.status}" for s in case.vehicle.sources)
    return attributes


def wind_samples(case: Case) -> float | None:
    """Return the number of independent soundings behind a vehicle's wind; None where its record does not say."""
    record = case.vehicle.wind.record if case.vehicle else None
    return None if record is None else record.independent_samples


def data_hash(case: Case) -> str:
    """Return a hash of parameters and tables, the mean response excepted, which follows from the others."""
    digest = hashlib.sha256()
    for group in case.executable.groups:
        if group.kind == "given":
            digest.update(group.run_time_vector().tobytes())
    digest.update(case.executable.parameters.tobytes())
    return digest.hexdigest()[:32]
