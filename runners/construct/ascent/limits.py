"""What ends a flight: engines that run dry, and what must not happen on the way."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterable, Mapping

from ....model.construction import Construction
from ....model.construction.flight import EngineGroup
from ....model.errors import DataError, ExtrapolationWarning
from ....model.standard_atmosphere import HIGHEST
from .integration import Ascent, Leg

log = logging.getLogger(__name__)
_STANDARD_GRAVITY = 9.80665  # m/s2
LEAST_HELD, MOST_HELD = 0.002, 0.05  # of the burn, by which engines outrun their table
_GROUND_TOLERANCE = 1e-3  # m, of the altitude at release


def first_depletion(ascent: Ascent, leg: Leg, running: Iterable[EngineGroup]) -> tuple[float, EngineGroup] | None:
    """Return time (s) and engine group of the first depletion in a leg, if there is one.

    A group runs dry when the liquid of a tank it draws from falls to its residual; only a group without a commanded
    cutoff may.

    Raises
    ------
    DataError
        A tank is empty while engines that draw from it still run by command.
    """
    found = []
    for group in (g for g in running if not g.solid):  # a solid motor's flow is that of its grain
        for tank in group.draws:
            left = group.residual.get(tank, 0.0)
            time = ascent.locate(leg, lambda o, tank=tank, left=left: o[f"liquid.{tank}"] - left)
            if time is not None:
                found.append((time, group, tank))
    if not found:
        return None
    time, group, tank = min(found, key=lambda f: f[0])
    if group.cutoff is not None:
        raise DataError(
            f"tank '{tank}' is drained to {group.residual.get(tank, 0.0):g} kg before engines '{group.name}' are cut "
            f"off at {group.cutoff:g} s; load more, lower the flow or the residual, cut off earlier, or give no cutoff "
            "so that they run until depletion",
            time=time,
        )
    log.info("tank '%s' is drained to its residual at %.3f s: engines '%s' stop", tank, time, group.name)
    return time, group


def check_lift_off(construction: Construction, observed: Mapping[str, float]) -> None:
    """Refuse a vehicle that does not rise from its pad."""
    if observed["axial_acceleration"] <= _STANDARD_GRAVITY:
        raise DataError(
            f"the thrust of {observed['thrust']:g} N does not lift {observed['mass']:g} kg; check masses and engines",
            time=construction.site.release,
        )


def check_held(group: EngineGroup, begin: float, end: float) -> None:
    """Warn of engines that burn beyond the rows of their thrust and flow, and refuse more than ``MOST_HELD``.

    Raises
    ------
    DataError
    """
    if group.solid:
        return
    first, last = float(group.time[0]), float(group.time[-1])
    before, after = max(first - begin, 0.0), max(end - last, 0.0)
    share = (before + after) / (end - begin)
    if share <= LEAST_HELD:
        return
    why = (
        f"engines '{group.name}' burn from {begin:g} to {end:g} s, but their thrust and flow are given from {first:g} "
        f"to {last:g} s and held for {before + after:.4g} s; extend the table, or give cutoff_s"
    )
    if share > MOST_HELD:
        raise DataError(why, time=last if after else begin)
    warnings.warn(why, ExtrapolationWarning, stacklevel=3)


def check_leg(ascent: Ascent, leg: Leg) -> None:
    """Refuse a leg that ends below the site, or beyond the tables over altitude and Mach number.

    Raises
    ------
    DataError
        Names the time at which it happens.
    """
    construction = ascent.construction
    ground = construction.site.altitude - _GROUND_TOLERANCE
    time = ascent.locate(leg, lambda o: o["altitude"] - ground)
    if time is not None:
        away = ascent.observe(leg, time)["surface_range"]
        raise DataError(
            f"the flight comes back to the ground, to an altitude of {ground:.0f} m, {away:.0f} m from the site; check "
            "the pitch programme and the thrust",
            time=time,
        )
    time = ascent.locate(leg, lambda o: o["altitude"] - HIGHEST)
    if time is not None:
        raise DataError(
            f"the flight passes {HIGHEST:g} m, where the standard atmosphere ends; give an earlier end_time", time=time
        )
    _check_mach(ascent, leg)


def _check_mach(ascent: Ascent, leg: Leg) -> None:
    construction = ascent.construction
    tables = [("drag", construction.drag.mach)]
    tables += [(f"normal-force component '{c.name}'", c.mach) for c in construction.normal_force]
    for name, mach in tables:
        low, high = float(mach[0]), float(mach[-1])
        for limit, where, way in ((low, "below", "first"), (high, "beyond", "last")):
            at_end = ascent.observe(leg, leg.end)["mach"]
            if not (at_end < limit if way == "first" else at_end > limit):
                continue
            time = ascent.locate(leg, lambda o, limit=limit: o["mach"] - limit)
            raise DataError(
                f"the flight reaches Mach {at_end:.3g}, {where} the {way} Mach number {limit:g} of {name}; extend that "
                "table or give another end_time",
                time=leg.begin if time is None else time,
            )
