"""A load along the vehicle in gusts: in the one that is worst at one place, and the largest at every station."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...model.vehicle.loads import BENDING_MOMENT
from ...model.vehicle.planes import flown_planes
from ..case.provenance import provenance
from ..station_loads.loads_along_vehicle import load_rows
from .clocking import largest, towards
from .response import described, gust_products
from .search import AFTER, GustSweep, WorstGust
from .shapes import Gust
from .weights import weights_of_rows


def gust_along_vehicle(
    sweep: GustSweep, worst: WorstGust, load: str = BENDING_MOMENT, *, slosh_reaction: bool = True
) -> xr.Dataset:
    """Return a load over (station) at the time of a worst gust.

    Parameters
    ----------
    sweep : GustSweep
    worst : WorstGust
        One of the sweep's.
    load : str
        Bending moment, shear force, axial force or equivalent axial load; in both planes the resultant of one of the
        first two.
    slosh_reaction : bool
        Whether the whole vehicle answers slosh, without which the moment does not vanish at the tail.

    Returns
    -------
    xarray.Dataset
        ``in_worst_gust`` of that gust, and ``envelope``, the largest size in it or any gust of the sweep, with its
        ``length`` and ``start_altitude``; in both planes of gusts from any direction.

    Raises
    ------
    DataError, UnknownNameError, IntegrationError
    """
    case, climb = sweep.case, sweep.climb
    planes = flown_planes(case.vehicle_for("a gust")) if sweep.from_any_direction else (None,)
    parts = [load_rows(case, [worst.time], load=load, slosh_reaction=slosh_reaction, plane=plane) for plane in planes]
    rows, winds = parts[0], case.wind_inputs("a gust")
    reach = max(worst.time - worst.time_met, sweep.longest + AFTER)
    state, direct = (np.concatenate([getattr(part, of)[0] for part in parts]) for of in ("state", "direct"))
    weights = weights_of_rows(case, [worst.time], [(state, direct[:, winds])], reach)[0]

    def by_station(gust: Gust, starts: NDArray[np.float64]) -> NDArray[np.float64]:
        products = gust_products(weights, climb, gust, starts).reshape(starts.size, len(parts), -1, len(winds))
        return products.swapaxes(1, 2)  # (starts, stations, planes, winds)

    in_planes = towards(by_station(worst.gust, np.array([worst.start_altitude]))[0], worst.direction)
    own = in_planes[:, 0] if len(parts) == 1 else np.linalg.norm(in_planes, axis=1)
    starts = sweep.starts(weights)
    found = np.array([largest(by_station(replace(sweep.gust, length=L), starts)) for L in sweep.lengths])
    flat = np.abs(found).reshape(-1, found.shape[2])
    best = flat.argmax(axis=0)
    q, p = np.unravel_index(best, found.shape[:2])
    envelope, length, start = flat.max(axis=0), sweep.lengths[q], starts[p]
    farther = np.abs(own) > envelope  # the worst gust is sought between the lengths and altitudes of the sweep
    envelope, length, start = (
        np.where(farther, new, old)
        for new, old in ((np.abs(own), envelope), (worst.gust.length, length), (worst.start_altitude, start))
    )
    units = {"units": rows.unit}
    return xr.Dataset(
        {
            "in_worst_gust": ("station", own, units | {"long_name": f"in the gust that is worst for {worst.response}"}),
            "envelope": ("station", envelope, units | {"long_name": "largest size in any gust"}),
            "length": ("station", length, {"units": "m", "long_name": "length of that gust"}),
            "start_altitude": ("station", start, {"units": "m", "long_name": "altitude at which it starts"}),
        },
        {
            "station": ("station", rows.station, {"units": "m", "long_name": "vehicle station"}),
            "forward_of_gimbal": ("station", rows.forward_of_gimbal, {"units": "m"}),
        },
        provenance(case)
        | described(worst.gust)
        | {"load": load, "time_s": worst.time, "slosh_reaction": str(slosh_reaction).lower()},
    )
