"""Weighting functions as labelled datasets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from ..case.case import Case
from ..case.provenance import provenance
from ..present.netcdf import RULE
from ..solvers.adjoint import AdjointHistory
from ..solvers.sweep import WeightingFunctions

NOISE_RULE = "response s^-0.5"  # of white noise, whose spectrum is 1 per hertz on both sides


def input_units(case: Case, *, impulse: bool = True) -> dict[str, str]:
    """Return the unit of a weighting function of the input, which is a wind in m/s of a vehicle and unknown elsewhere.

    Without ``impulse`` that of the response to the input itself.
    """
    if case.vehicle is None:
        return {}
    return {RULE: "response m^-1" if impulse else "response s m^-1"}


def weighting_dataset(case: Case, time: float, history: AdjointHistory) -> xr.Dataset:
    """Return weighting functions g(t2, t) as a dataset."""
    system = case.system
    return xr.Dataset(
        {
            "noise_weighting": (
                ("response", "noise", "t"),
                np.moveaxis(history.noise, 0, -1),
                {RULE: NOISE_RULE, "long_name": "weighting function of white noise"},
            ),
            "input_weighting": (
                ("response", "input", "t"),
                np.moveaxis(history.inputs, 0, -1),
                input_units(case) | {"long_name": "weighting function of the input"},
            ),
            "direct": (
                ("response", "input"),
                history.direct,
                input_units(case, impulse=False) | {"long_name": "weight of the delta at t = t2"},
            ),
        },
        {
            "t": ("t", history.times, {"units": "s", "long_name": "time of the impulse"}),
            "response": list(system.output_names),
            "unit": ("response", [o.unit for o in system.outputs]),
            "noise": [n.name for n in system.noises],
            "source": ("noise", [n.source for n in system.noises]),
            "input": list(system.input_names),
        },
        provenance(case) | {"t2_s": time},
    )


def weighting_family(case: Case, times: Sequence[float], weighting: WeightingFunctions) -> xr.Dataset:
    """Return the weighting functions of all end times (s) as a dataset."""
    system = case.system
    dims = {
        "noise_weighting": ("time", "response", "noise", "t"),
        "input_weighting": ("time", "response", "input", "t"),
    }
    values = {"noise_weighting": weighting.noise, "input_weighting": weighting.inputs}
    attributes = {
        "noise_weighting": {RULE: NOISE_RULE, "long_name": "weighting function of white noise"},
        "input_weighting": input_units(case) | {"long_name": "weighting function of the input"},
    }
    return xr.Dataset(
        {name: (dims[name], np.moveaxis(values[name], 1, -1), attributes[name]) for name in dims},
        {
            "time": ("time", list(times), {"units": "s", "long_name": "flight time t2"}),
            "t": ("t", weighting.times, {"units": "s", "long_name": "time of the impulse"}),
            "response": list(system.output_names),
            "unit": ("response", [o.unit for o in system.outputs]),
            "noise": list(system.noise_names),
            "source": ("noise", [n.source for n in system.noises]),
            "input": list(system.input_names),
        },
        provenance(case),
    )
