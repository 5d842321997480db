"""Soundings written in the formats that the readers know, from the same winds; and where real files may lie."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

REAL = Path(__file__).parents[3] / "shared" / "data" / "wind" / "real"  # beside the repository, where somebody has them
START = datetime.datetime(2003, 3, 1, 12)
GRAVITY = 9.80665


def real_file(name: str) -> Path:
    """Return a real file, or skip the test."""
    if not (REAL / name).is_file():
        pytest.skip("real files of soundings are not kept in the project")
    return REAL / name


def times(count: int) -> list[datetime.datetime]:
    return [START + datetime.timedelta(days=k) for k in range(count)]


def polar(u, v) -> tuple[np.ndarray, np.ndarray]:
    """Return speed and the direction that a wind comes from, deg."""
    return np.hypot(u, v), np.degrees(np.arctan2(-np.asarray(u), -np.asarray(v))) % 360


def whole(value: float, factor: float = 1.0, missing: str = "-9999") -> str:
    return missing if np.isnan(value) else f"{round(factor * value):d}"


def igra_text(altitude, u, v, station: str = "USM00074794", when=None) -> str:
    """Return profiles (n, k) as IGRA version 2: tenths of m/s, whole degrees; NaN is -9999."""
    lines = []
    for time, row_u, row_v in zip(when or times(len(u)), u, v, strict=True):
        lines.append(
            f"#{station:<11} {time:%Y %m %d %H} {time:%H%M} {len(altitude):4d} ncdc6301 ncdc6301  284833  -805500"
        )
        for h, s, d in zip(altitude, *polar(row_u, row_v), strict=True):
            lines.append(f"30 -9999  -9999 {whole(h):>5s} -9999 -9999 -9999 {whole(d):>5s} {whole(s, 10):>5s} ")
    return "\n".join(lines) + "\n"


def wyoming_csv_text(altitude, u, v) -> str:
    """Return one profile as Wyoming's CSV: whole degrees, tenths of m/s."""
    names = (
        "time,longitude,latitude,pressure_hPa,geopotential height_m,temperature_C,dew point temperature_C,"
        "wind direction_degree,wind speed_m/s"
    )
    lines = [names]
    for h, s, d in zip(altitude, *polar(u, v), strict=True):
        lines.append(f"{START:%Y-%m-%d %H:%M:%S},-80.5500,28.4800,,{h:5.0f},,,{d:3.0f},{s:4.1f}")
    return "\n".join(lines) + "\n"


def wyoming_list_text(altitude, u, v) -> str:
    """Return profiles (n, k) as Wyoming's text list: whole degrees and knots."""
    lines = []
    for time, row_u, row_v in zip(times(len(u)), u, v, strict=True):
        lines += [f"74794 XMR Cape Canaveral Observations at {time:%HZ %d %b %Y}", "", "-" * 77]
        lines.append("".join(f"{x:>7s}" for x in ("PRES", "HGHT", "TEMP", "DWPT", "RELH", "MIXR", "DRCT", "SKNT")))
        lines.append("".join(f"{x:>7s}" for x in ("hPa", "m", "C", "C", "%", "g/kg", "deg", "knot")))
        lines.append("-" * 77)
        for h, s, d in zip(altitude, *polar(row_u, row_v), strict=True):
            lines.append(f"{900.0:7.1f}{h:7.0f}{'':28s}{d:7.0f}{s * 3600 / 1852:7.0f}")
        lines += ["", "Station information and sounding indices", "", "                  Station identifier: XMR"]
    return "\n".join(lines) + "\n"


def fsl_text(altitude, u, v, unit: str = "ms") -> str:
    """Return profiles (n, k) as FSL text: whole degrees, tenths of m/s or knots."""
    factor, lines = {"ms": 10.0, "kt": 3600 / 1852}[unit], []
    for time, row_u, row_v in zip(times(len(u)), u, v, strict=True):
        lines.append(f"    254 {time.hour:6d} {time.day:6d}      {time:%b}".upper() + f"    {time.year}")
        lines.append("      1  12868  74794  28.48N 80.55W     5  99999")
        lines.append(f"      2  99999  99999  99999 {len(altitude) + 4:6d}  99999  99999")
        lines.append(f"      3           XMR                  99999     {unit}")
        for k, (h, s, d) in enumerate(zip(altitude, *polar(row_u, row_v), strict=True)):
            kind = 9 if not k else 4
            lines.append(
                f"{kind:7d}  99999 {whole(h, 1, '99999'):>6s}  99999  99999 {whole(d, 1, '99999'):>6s} "
                f"{whole(s, factor, '99999'):>6s}"
            )
    return "\n".join(lines) + "\n"


def own_text(altitude, u, v, *, altitude_unit: str = "m", speed_unit: str = "m/s", by_direction: bool = False) -> str:
    """Return profiles (n, k) as the project's own CSV in some units, with all digits; NaN rows are left out."""
    height = {"m": 1.0, "km": 1e-3, "ft": 1 / 0.3048}[altitude_unit]
    speed = {"m/s": 1.0, "kt": 3600 / 1852, "ft/s": 1 / 0.3048, "km/h": 3.6}[speed_unit]
    names = f"speed [{speed_unit}],direction [deg]" if by_direction else f"u [{speed_unit}],v [{speed_unit}]"
    lines = [f"profile,date,altitude [{altitude_unit}],{names}"]
    for k, (time, row_u, row_v) in enumerate(zip(times(len(u)), u, v, strict=True)):
        for h, x, y in zip(altitude, row_u, row_v, strict=True):
            if np.isnan(x):
                continue
            s, d = polar(x, y)
            first, second = (s * speed, d) if by_direction else (x * speed, y * speed)
            lines.append(f"{k},{time:%Y-%m-%dT%H:%M},{float(h * height)!r},{float(first)!r},{float(second)!r}")
    return "\n".join(lines) + "\n"


def era5(altitude, u, v, *, new: bool, latitude=(28.5,), longitude=(-80.5,)) -> xr.Dataset:
    """Return profiles (n, k) as ERA5 has them in its new or old dialect, levels from above or from below."""
    lat, lon = np.array(latitude), np.array(longitude)
    time, level = ("valid_time", "pressure_level") if new else ("time", "level")
    pressure = 1013.0 * np.exp(-np.asarray(altitude) / 7500.0)
    order = np.argsort(-pressure) if new else np.argsort(pressure)

    def field(values: np.ndarray) -> np.ndarray:
        return np.broadcast_to(values[:, order, None, None], (len(u), len(order), lat.size, lon.size)).copy()

    dims = (time, level, "latitude", "longitude")
    height = np.broadcast_to(np.asarray(altitude, float), np.shape(u))
    found = xr.Dataset(
        {
            "u": (dims, field(np.asarray(u)), {"units": "m s**-1"}),
            "v": (dims, field(np.asarray(v)), {"units": "m s**-1"}),
            "z": (dims, field(height * GRAVITY), {"units": "m**2 s**-2"}),
        },
        {
            time: np.array(times(len(u)), "datetime64[ns]"),
            level: (level, pressure[order], {"units": "hPa" if new else "millibars"}),
            "latitude": lat,
            "longitude": lon,
        },
    )
    return found.assign_coords(number=0) if new else found
