"""Levels of a whole flight, their exceedance, limits and margins."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..present.wording import display, words
from .figures import curve_ink, lines
from .parts import Figure, Key, Part, Table, Text

MOST_LIMITS = 12  # drawn or listed


def levels(found: xr.Dataset) -> list[Part]:
    """Return levels by response and probability, where they come from, and exceedance curves."""
    parts: list[Part] = [_levels(found)]
    if "share" in found:
        parts.append(_shares(found))
    return [*parts, *_exceedance(found)]


def limits_over_time(found: xr.Dataset) -> list[Part]:
    """Return the chance to pass each response's own limit and the margin left, empty where no limit was given."""
    if "limit_passage_probability" not in found:
        return []
    rows = []
    for name in found["response"].values:
        at = found.sel(response=name)
        chance, error = float(at["limit_passage_probability"]), float(at["limit_passage_error"])
        if np.isfinite(chance):
            row = words(str(name)), f"{chance:.3g}", f"{1.96 * error:.2g}", f"{float(at['margin_of_safety']):+.3f}"
            rows.append(row)
    head = ("response", "chance to pass its limit", "± 95 % of the sampling", "margin of safety")
    return (
        [Table("Limits over time", head, rows, "The margin of safety is limit over level, minus one.")] if rows else []
    )


def limits_together(found: xr.Dataset) -> list[Part]:
    """Return the joint chance to pass any limit, and the loads that pass most often."""
    attrs = found.attrs
    chance, left = float(attrs["probability"]), float(attrs["margin_of_safety"])
    design = float(attrs["design_probability"])
    parts: list[Part] = [
        Text(
            f"Any of {found.sizes['load']} limits is passed by {chance:.3g} of flights (± "
            f"{1.96 * float(attrs['standard_error']):.2g} of the sampling); at {design:g} the margin of safety is "
            f"{left:+.3f}.",
            "good" if left >= 0 else "bad",
        )
    ]
    by_load = found["passage_probability"].values
    order = sorted(range(by_load.size), key=lambda k: -by_load[k])[:MOST_LIMITS]
    rows = []
    for k in order:
        at = found.isel(load=k)
        unit = str(at["load_units"].item())
        factor, shown = display(unit, at["limit"].values)
        worst = int(np.nanargmin(at["margin"].values))
        station = float(at["station"])
        numbers = (f"{factor * float(at[n][worst]):.4g}" for n in ("limit", "level", "margin"))
        rows.append(
            (words(str(at["load_name"].item())), "" if np.isnan(station) else f"{station:g} m", f"{by_load[k]:.3g}",
             f"{float(at['time'][worst]):g} s", *numbers, shown)
        )  # fmt: skip
    head = ("load", "station", "chance", "least margin at", "limit", f"level at {design:g}", "margin", "unit")
    parts.append(Table("Limits passed most often", head, rows))
    first = found.isel(load=order[0])
    factor, unit = display(str(first["load_units"].item()), first["limit"].values)
    name = words(str(first["load_name"].item()))
    parts.append(
        lines(
            f"{name.capitalize()} and its limit",
            f"Limit of the {name} and the level passed at each instant with probability {design:g}, in {unit}.",
            ("flight time (s)", first["time"].values[::4]),
            [
                (Key("limit", "mean", "dashed"), factor * first["limit"].values[::4]),
                (Key(f"level passed with {design:g}", "combined"), factor * first["level"].values[::4]),
            ],
            f"size of the {name} ({unit})",
        )
    )
    return parts


def _levels(found: xr.Dataset) -> Table:
    rows = []
    for name, unit in zip(found["response"].values, found["response_units"].values, strict=True):
        at = found.sel(response=name)
        for k, p in enumerate(at["probability"].values):
            value, instant = (float(at[n].values[k]) for n in ("flight_level", "instant_level"))
            if not np.isfinite(value):
                continue
            factor, shown = display(str(unit), value)
            low, high = at["flight_level_interval"].values[k]
            row = [words(str(name)), f"{p:g}", f"{factor * value:.4g} {shown}".removesuffix(" 1")]
            row += [f"{factor * low:.4g} to {factor * high:.4g}", f"{factor * instant:.4g}", f"{value / instant:.3f}"]
            if "wind_interval" in at:
                below, above = at["wind_interval"].values[k]
                row.append(f"{factor * below:.4g} to {factor * above:.4g}" if np.isfinite(below) else "")
            rows.append(row)
    head = ["response", "chance", "level of the flight", "95 % of the sampling", "worst instant's level", "ratio"]
    head += ["95 % by the wind's soundings"] if "wind_interval" in found else []
    begin, end = found.attrs["window_s"]
    return Table(f"Largest values of a whole flight, {begin:g} to {end:g} s", head, rows)


def _shares(found: xr.Dataset) -> Table:
    share = found["share"].isel(probability=0)
    sources = [str(s) for s in found["source"].values]
    rows = [
        (words(str(name)), *(f"{100 * float(x):.2f} %" for x in share.sel(response=name).values))
        for name in found["response"].values
    ]
    return Table("Shares of the sources where the level is reached", ("response", *map(words, sources)), rows)


def _exceedance(found: xr.Dataset) -> list[Figure]:
    figures = []
    for k, (name, unit) in enumerate(zip(found["response"].values, found["response_units"].values, strict=True)):
        at = found.sel(response=name)
        level, chance = at["exceedance_level"].values, at["exceedance"].values
        known = np.isfinite(level) & (chance > 1e-9)
        if known.sum() < 2:
            continue
        factor, shown = display(str(unit), level[known])
        label = words(str(name))
        figures.append(
            lines(
                f"Chance that a flight's largest {label} passes a level",
                f"Probability over level of the {label} in {shown}, from {chance[known].max():.2g} down.",
                (f"{label} ({shown})", factor * level[known]),
                [(Key(label, curve_ink(k)), chance[known])],
                "chance of a flight",
                logarithmic=True,
            )
        )
    return figures
