"""Weighting functions as labelled datasets."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..case.case import Case
from ..case.provenance import provenance
from ..solvers.adjoint import AdjointHistory
from ..solvers.sweep import SweepResult


def weighting_dataset(case: Case, time: float, history: AdjointHistory) -> xr.Dataset:
    """Return weighting functions g(t2, t) as a dataset."""
    system = case.system
    units = "; ".join(f"{o.name}: {o.unit}" for o in system.outputs)
    return xr.Dataset(
        {
            "noise_weighting": (
                ("response", "noise", "t"),
                np.moveaxis(history.noise, 0, -1),
                {"units": f"response unit / sqrt(s) ({units})", "long_name": "weighting function of white noise"},
            ),
            "input_weighting": (
                ("response", "input", "t"),
                np.moveaxis(history.inputs, 0, -1),
                {"units": f"response unit / (input unit s) ({units})", "long_name": "weighting function of the input"},
            ),
            "direct": (
                ("response", "input"),
                history.direct,
                {"units": "response unit / input unit", "long_name": "weight of the delta at t = t2"},
            ),
        },
        {
            "t": ("t", history.times, {"units": "s", "long_name": "time of the impulse"}),
            "response": list(system.output_names),
            "noise": [n.name for n in system.noises],
            "source": ("noise", [n.source for n in system.noises]),
            "input": list(system.input_names),
        },
        provenance(case) | {"t2_s": time},
    )


def weighting_family(case: Case, found: SweepResult) -> xr.Dataset:
    """Return the weighting functions of all end times of a sweep as a dataset."""
    system, weighting = case.system, found.weighting
    assert weighting is not None
    dims = {
        "noise_weighting": ("time", "response", "noise", "t"),
        "input_weighting": ("time", "response", "input", "t"),
    }
    values = {"noise_weighting": weighting.noise, "input_weighting": weighting.inputs}
    return xr.Dataset(
        {name: (dims[name], np.moveaxis(values[name], 1, -1)) for name in dims},
        {
            "time": ("time", found.times, {"units": "s", "long_name": "flight time t2"}),
            "t": ("t", weighting.times, {"units": "s", "long_name": "time of the impulse"}),
            "response": list(system.output_names),
            "noise": list(system.noise_names),
            "source": ("noise", [n.source for n in system.noises]),
            "input": list(system.input_names),
        },
        provenance(case),
    )
