"""Peaks, shares and curves of response statistics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr

from ...model.system.names import COMBINED
from ..present.netcdf import RULE
from ..present.wording import display, words
from ..statistics.larger_side import LABEL, SIGMAS, sign
from ..statistics.peaks import Peak
from ..statistics.results import ResponseStatistics
from .figures import bars, curve_ink, lines
from .parts import Figure, Key, Part, Section, Table, Text

ROWS = 160  # of a table of values
SHOWN = 45.0  # s of a weighting function
TIME = "flight time (s)"


def sentence(statistics: ResponseStatistics) -> list[str]:
    """Return what the first response's peak is, and the flight's level, in a sentence each."""
    first = statistics.peaks()[0]
    factor, unit = display(first.unit, first.value)
    main = max(first.shares, key=lambda s: first.shares[s]) if first.shares else ""
    told = [
        f"{words(first.response).capitalize()}: {LABEL} is at most {factor * first.value:.4g} {unit} "
        f"({first.side}, at {first.time:g} s): mean {factor * first.mean:.4g}, sigma {factor * first.std:.4g} {unit}."
    ]
    if main and first.shares[main] > 0:
        told.append(f"{100 * first.shares[main]:.3g} % of that variance is from {words(main)}.")
    levels = flight_levels(statistics)
    if first.response in levels:
        value, low, high = levels[first.response]
        told.append(
            f"{level_meaning(statistics)} is above {factor * value:.4g} {unit} (95 % of the sampling: "
            f"{factor * low:.4g} to {factor * high:.4g})."
        )
    return told


def flight_levels(statistics: ResponseStatistics) -> dict[str, tuple[float, float, float]]:
    """Return the level of the whole flight and the ends of its interval by response, SI, where they were computed."""
    data = statistics.dataset
    if "flight_level" not in data:
        return {}
    parts = (data[name].values for name in ("flight_level", "flight_level_lower", "flight_level_upper"))
    rows = zip(data["response"].values, *parts, strict=True)
    return {str(name): (float(v), float(a), float(b)) for name, v, a, b in rows if np.isfinite(v)}


def level_meaning(statistics: ResponseStatistics) -> str:
    """Return what the flight's level is, as the beginning of a sentence."""
    (begin, end), chance = statistics.attrs["flight_level_window_s"], statistics.attrs["flight_level_probability"]
    return f"With probability {chance:g} the largest value of a whole flight, {begin:g} to {end:g} s,"


def peak_table(statistics: ResponseStatistics) -> list[Part]:
    """Return the peaks of all responses beside the flight's level."""
    found, levels = statistics.peaks(), flight_levels(statistics)
    head = ["response", LABEL, "at", "side", "mean", "sigma"]
    if levels:
        head += ["flight's level", "95 % of its sampling"]
    rows = []
    for peak in found:
        factor, unit = display(peak.unit, peak.value)
        numbers = [f"{factor * x:.4g} {unit}".removesuffix(" 1") for x in (peak.value, peak.mean, peak.std)]
        row = [
            words(peak.response),
            numbers[0],
            f"{peak.time:g} s{'*' if peak.at_end else ''}",
            peak.side,
            *numbers[1:],
        ]
        if levels:
            value, low, high = levels.get(peak.response, (np.nan,) * 3)
            known = np.isfinite(value)
            row += [
                f"{factor * value:.4g} {unit}".removesuffix(" 1") if known else "none",
                f"{factor * low:.4g} to {factor * high:.4g}" if known else "",
            ]
        rows.append(row)
    notes = []
    if any(peak.at_end for peak in found):
        notes.append("* on the first or last end time; the peak of the flight may lie beyond.")
    if levels:
        notes.append(f"{level_meaning(statistics)} is above the flight's level, which no single instant gives.")
    return [Table(f"Peaks of {LABEL}", head, rows, " ".join(notes))]


def verdict(statistics: ResponseStatistics) -> list[Part]:
    """Return what two independent engines say of the peaks."""
    attrs = statistics.attrs
    if "peak_verdict" not in attrs:
        return [Text("The peaks were computed by one engine alone and stand unchecked.", "bad")]
    data = statistics.dataset
    agree = bool(int(attrs.get("peaks_agree", 0)))
    rows = []
    for peak in statistics.peaks():
        at = data.sel(response=peak.response)
        factor, unit = display(peak.unit, peak.value)
        other = abs(float(at["peak_reference_mean"])) + SIGMAS * float(at["peak_reference_std"])
        rows.append(
            (words(peak.response), f"{factor * peak.value:.6g}", f"{factor * other:.6g}", unit,
             f"{float(at['peak_difference']):.1e}", f"{float(at['peak_std_difference']):.1e}")
        )  # fmt: skip
    other = {"cvodes": "CVODES", "covariance": "covariance equation"}.get(str(attrs["peak_reference"]), "")
    head = ("response", str(attrs["engine"]), other, "unit", "relative difference", "of sigma")
    return [
        Text(str(attrs["peak_verdict"]), "good" if agree else "bad"),
        Table("Peaks by two engines that share only the equations", head, rows, folded=True),
    ]


def shares(statistics: ResponseStatistics) -> list[Part]:
    """Return which source gives how much of the variance at each peak."""
    found = statistics.peaks()
    sources = list(found[0].shares)
    if not sources:
        return []
    names = [words(p.response) for p in found]
    parts = [
        (Key(words(s), curve_ink(k)), [100 * p.shares[s] for p in found]) for k, s in enumerate(sources)
    ]  # fmt: skip
    what = f"Share of each source in the variance of every response at its peak of {LABEL}"
    rows = [(words(p.response), *(f"{100 * p.shares[s]:.2f} %" for s in sources)) for p in found]
    return [
        bars("Share of the variance at the peak", what, names, parts, "share of the variance (%)"),
        Table("Share of the variance at the peak", ("response", *map(words, sources)), rows),
    ]


def curves(statistics: ResponseStatistics) -> Section:
    """Return every response over time, its weighting function where it was kept, and its values."""
    parts: list[Part] = []
    for peak in statistics.peaks():
        weighting = _weighting(statistics.dataset, peak)
        shown = _over_time(statistics, peak)
        parts += [replace(shown, alone=True)] if weighting is None else [shown, weighting]
    tables = [_values(statistics, peak) for peak in statistics.peaks()]
    return Section("curves", "Responses over the flight", [*parts, *tables], wide=True)


def _over_time(statistics: ResponseStatistics, peak: Peak) -> Figure:
    data = statistics.dataset.sel(response=peak.response)
    factor, unit = display(peak.unit, peak.value)
    mean = factor * data["mean"].sel(source=COMBINED).values
    sigma = factor * data["std"].sel(source=COMBINED).values
    first = str(data["source"].values[0])
    toward = sign(peak.mean) * SIGMAS * factor * data["std"].sel(source=first).values
    name = words(peak.response)
    return lines(
        f"{name.capitalize()}",
        f"{name} over flight time in {unit}: mean, mean plus and minus 3 sigma from all sources as a band, and "
        f"{peak.side} from {words(first)} alone. The largest is {factor * peak.value:.4g} {unit} at {peak.time:g} s.",
        (TIME, data["time"].values),
        [
            (Key("mean", "mean"), mean),
            (Key(f"{peak.side}, {words(first)} alone", "wind"), mean + toward),
            (Key("mean + 3σ, all sources", "combined", "dashed"), mean + SIGMAS * sigma),
            (Key("mean - 3σ, all sources", "combined", "dashed"), mean - SIGMAS * sigma),
        ],
        f"{name} ({unit})",
        (Key("mean ± 3σ", "combined", "band"), mean - SIGMAS * sigma, mean + SIGMAS * sigma),
    )


def _weighting(data: xr.Dataset, peak: Peak) -> Figure | None:
    if "peak_input_weighting" not in data or not data.sizes.get("input"):
        return None
    at = data.sel(response=peak.response)
    time = at["peak_weighting_time"].values
    known = np.isfinite(time)
    values = at["peak_input_weighting"].values.reshape(-1, time.size)[0][known]
    time = time[known]
    if time.size < 2 or not np.isfinite(values).all() or not np.abs(values).max() > 0:
        return None
    factor, unit = display(peak.unit, values)
    name, source = words(peak.response), words(str(data["input"].values[0]))
    late = time > time[-1] - SHOWN
    given = "m/s" if data["peak_input_weighting"].attrs.get(RULE) else f"unit of {source}"
    return lines(
        f"Weighting function of {name} at {peak.time:g} s",
        f"What an impulse of {source} at an earlier time does to the {name} at {peak.time:g} s, the adjoint's answer.",
        ("time of the impulse (s)", time[late]),
        [(Key(f"g(t₂, t), {source} to {name}", "wind"), factor * values[late])],
        f"g(t₂, t) in {unit} / (({given}) · s)",
    )


def _values(statistics: ResponseStatistics, peak: Peak) -> Table:
    data = statistics.dataset.sel(response=peak.response)
    factor, unit = display(peak.unit, peak.value)
    sources = [str(s) for s in data["source"].values]
    mean = factor * data["mean"].sel(source=COMBINED).values
    sigmas = {s: factor * data["std"].sel(source=s).values for s in sources}
    times = data["time"].values
    every = -(-times.size // ROWS)
    rows = [
        (f"{times[k]:g}", f"{mean[k]:.5g}", *(f"{sigmas[s][k]:.4g}" for s in sources),
         f"{mean[k] - SIGMAS * sigmas[COMBINED][k]:.5g}", f"{mean[k] + SIGMAS * sigmas[COMBINED][k]:.5g}")
        for k in range(0, times.size, every)
    ]  # fmt: skip
    head = (
        "time (s)",
        "mean",
        *(f"sigma, {'all' if s == COMBINED else words(s)}" for s in sources),
        "mean - 3σ",
        "mean + 3σ",
    )
    note = "" if every == 1 else f"Every {every}th end time; all are in statistics.csv."
    return Table(f"Values of {words(peak.response)} ({unit})", head, rows, note, folded=True)
