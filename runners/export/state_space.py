"""A system frozen at a time as an object of a control library."""

from __future__ import annotations

import importlib
from typing import Any, Literal

import numpy as np

from ...model.errors import MissingLibraryError, UnknownNameError
from ..case.case import Case
from ..solvers.stability import matrices_at

LIBRARIES = ("control", "scipy")


def state_space(case: Case, time: float, library: Literal["control", "scipy"] = "control") -> Any:
    """Return the system frozen at a time; inputs are the white noises, then the known inputs.

    Parameters
    ----------
    case : Case
    time : float
        s; at a jump after it.
    library : {'control', 'scipy'}

    Raises
    ------
    TimeRangeError, UnknownNameError, MissingLibraryError
    """
    if library not in LIBRARIES:
        raise UnknownNameError("library", library, LIBRARIES)
    case.checked_times([time])
    system, m = case.system, matrices_at(case.with_means, float(time))
    arrays = (m["A"], np.hstack([m["B"], m["E"]]), m["C"], np.hstack([m["D"], m["G"]]))
    if library == "scipy":
        from scipy.signal import StateSpace

        return StateSpace(*arrays)
    try:
        control = importlib.import_module("control")
    except ImportError as error:
        raise MissingLibraryError(
            f"python-control cannot be imported ({error}); pip install 'ascentwind[control]', or take library='scipy'"
        ) from None
    return control.StateSpace(
        *arrays,
        name=system.name,
        states=list(system.state_names),
        inputs=[*system.noise_names, *system.input_names],
        outputs=list(system.output_names),
        remove_useless_states=False,
    )
