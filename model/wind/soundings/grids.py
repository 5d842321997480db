"""Fields on pressure levels, ERA5 and its like, at one place: netCDF by xarray, GRIB where cfgrib is installed."""

from __future__ import annotations

import datetime
import importlib
import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from ...errors import MissingLibraryError
from .igra import Wanted
from .quality import Quality
from .raw_levels import RawLevels
from .sounding import GRAVITY, Sounding, SoundingError

if TYPE_CHECKING:
    import xarray as xr

Point = Literal["nearest", "bilinear"]
POINTS = ("nearest", "bilinear")
TIMES = ("valid_time", "time")
LEVELS = ("pressure_level", "level", "isobaricInhPa", "plev")
PLACES = {"latitude": ("latitude", "lat"), "longitude": ("longitude", "lon")}
VARIABLES = {  # what is wanted: names, standard names
    "u": (("u", "ua", "u_component_of_wind"), "eastward_wind"),
    "v": (("v", "va", "v_component_of_wind"), "northward_wind"),
    "geopotential": (("z", "geopotential"), "geopotential"),
    "geopotential height": (("gh", "zg", "hgt", "geopotential_height"), "geopotential_height"),
}
SPEED_UNITS = ("m s**-1", "m s-1", "m/s", "m s^-1")
GEOPOTENTIAL_UNITS = ("m**2 s**-2", "m2 s-2", "m2/s2", "m^2 s^-2")
HEIGHT_UNITS = ("m", "gpm")
CALENDARS = ("standard", "gregorian", "proleptic_gregorian")
GRIB, HDF5, CLASSIC = b"GRIB", b"\x89HDF", b"CDF"


def is_grid(start: bytes) -> bool:
    """Return whether a file begins as netCDF or GRIB does."""
    return start.startswith((GRIB, HDF5, CLASSIC))


def read_grid(
    file: Path,
    latitude: float | None,
    longitude: float | None,
    point: Point,
    wanted: Wanted,
    quality: Quality,
) -> Iterator[Sounding]:
    """Return the wind over one place at every time.

    Parameters
    ----------
    latitude, longitude : float, optional
        deg; a field of one place needs none.
    point : {'nearest', 'bilinear'}
        The nearest point of the field, or linear between the four around.

    Raises
    ------
    MissingLibraryError
        GRIB without cfgrib, netCDF-4 without h5netcdf.
    SoundingError
        A variable, unit or dimension that is not there, a place off the field, another calendar.
    """
    with _opened(file) as dataset:
        time_name = _dimension(dataset, TIMES, "time", file)
        level = _dimension(dataset, LEVELS, "pressure level", file)
        place = {what: _dimension(dataset, names, what, file) for what, names in PLACES.items()}
        fields = {what: _variable(dataset, what, file) for what in ("u", "v")}
        for what, values in fields.items():
            _refuse_unit(values, what, SPEED_UNITS, file)
        height = _height(dataset, file)
        times = _times(dataset[time_name], file)
        parts = [
            _at_place(_plain(part, (time_name, level, *place.values()), file), place, latitude, longitude, point, file)
            for part in (fields["u"], fields["v"], height)
        ]
        where = ", ".join(f"{float(parts[0][name].values):g} {what}" for what, name in place.items())
        u, v, h = (part.transpose(time_name, level).values.astype(float) for part in parts)
    quality.notes.append(f"{file.name}: {point} point, {where}")
    for k, time in enumerate(times):
        quality.read += 1
        if why := wanted(time):
            quality.selected[why] += 1
            continue
        name = f"{file.stem} {time:%Y-%m-%d %H} UTC"
        raw = RawLevels(file, name, where, time, in_order=False)
        speed = np.hypot(u[k], v[k])
        direction = np.degrees(np.arctan2(-u[k], -v[k])) % 360.0
        for row in range(u.shape[1]):
            raw.add(0, np.nan, h[k, row], np.nan, speed[row], direction[row])
        yield raw.sounding(quality)


def _opened(file: Path) -> xr.Dataset:
    import xarray as xr

    with file.open("rb") as stream:
        start = stream.read(4)
    if start == GRIB:
        library, engine, meant = "cfgrib", "cfgrib", "GRIB"
    elif start == HDF5:
        library, engine, meant = "h5netcdf", "h5netcdf", "netCDF-4"
    else:
        library, engine, meant = "scipy", "scipy", "netCDF"
    if importlib.util.find_spec(library) is None:
        raise MissingLibraryError(
            f"is {meant}, which {library} reads; install it with 'pip install {library}', or convert the file to "
            "netCDF-3 or CSV", file=file,
        )  # fmt: skip
    try:
        importlib.import_module(library)
    except Exception as error:  # such as cfgrib without the library of ecCodes
        raise MissingLibraryError(
            f"is {meant}, which {library} reads, and that is there but does not start ({error!s:.120}); install it "
            f"anew with 'pip install --force-reinstall {library}{' eccodes' if engine == 'cfgrib' else ''}', or "
            "convert the file to netCDF-3 or CSV", file=file,
        ) from None  # fmt: skip
    try:
        if engine == "cfgrib":
            return xr.open_dataset(file, engine=engine, backend_kwargs={"indexpath": ""})  # no index beside the file
        return xr.open_dataset(file, engine=engine, decode_times=False)
    except Exception as error:  # whatever a library makes of a damaged file
        raise SoundingError(f"cannot be read as {meant} ({error!s:.200})", file=file) from None


def _dimension(dataset: xr.Dataset, names: tuple[str, ...], what: str, file: Path) -> str:
    found = [name for name in names if name in dataset.coords and dataset[name].ndim <= 1]
    if not found:
        raise SoundingError(
            f"has no coordinate of {what}: {' or '.join(names)}; it has {', '.join(map(str, dataset.coords))}",
            file=file,
        )
    return next((name for name in found if name in dataset.dims), found[0])


def _variable(dataset: xr.Dataset, what: str, file: Path) -> xr.DataArray:
    names, standard = VARIABLES[what]
    for name, values in dataset.data_vars.items():
        if name in names or values.attrs.get("standard_name") == standard:
            return values
    raise SoundingError(
        f"has no variable of {what}: {' or '.join(names)}; it has {', '.join(map(str, dataset.data_vars))}", file=file
    )


def _height(dataset: xr.Dataset, file: Path) -> xr.DataArray:
    """Return the geopotential height, m."""
    try:
        height = _variable(dataset, "geopotential height", file)
    except SoundingError:
        geopotential = _variable(dataset, "geopotential", file)
        _refuse_unit(geopotential, "geopotential", GEOPOTENTIAL_UNITS, file)
        return geopotential / GRAVITY
    _refuse_unit(height, "geopotential height", HEIGHT_UNITS, file)
    return height


def _refuse_unit(values: xr.DataArray, what: str, known: tuple[str, ...], file: Path) -> None:
    unit = values.attrs.get("units")
    if unit not in known:
        told = "has no unit" if unit is None else f"is in '{unit}'"
        raise SoundingError(f"{what} {told}, expected {known[0]}", file=file)


def _times(coordinate: xr.DataArray, file: Path) -> list[datetime.datetime]:
    import xarray as xr

    calendar = str(coordinate.attrs.get("calendar", CALENDARS[0]))
    if calendar not in CALENDARS:
        raise SoundingError(
            f"counts time in the calendar '{calendar}', whose days are not those of balloons; take a field in the "
            "standard calendar", file=file,
        )  # fmt: skip
    counts = np.issubdtype(coordinate.dtype, np.number)
    if counts and " since " not in str(coordinate.attrs.get("units", "")):
        raise SoundingError(
            f"its times are numbers without 'units' such as 'hours since 1900-01-01' ({coordinate.name}); say what "
            "they count from", file=file,
        )  # fmt: skip
    try:
        decoded = xr.decode_cf(xr.Dataset({"time_": ("n", np.atleast_1d(coordinate.values), coordinate.attrs)}))[
            "time_"
        ]
        stamps = decoded.values.astype("datetime64[s]")
    except (ValueError, TypeError, OverflowError) as error:
        raise SoundingError(f"its times cannot be read ({error!s:.120})", file=file) from None
    return [stamp.item() for stamp in stamps]


def _plain(values: xr.DataArray, kept: tuple[str, ...], file: Path) -> xr.DataArray:
    """Return a field over time, level and place alone; ERA5's preliminary and final values are put together."""
    for dim in [d for d in values.dims if d not in kept]:
        if values.sizes[dim] == 1:
            values = values.isel({dim: 0})
        elif dim == "expver":
            merged = values.isel({dim: 0})
            for k in range(1, values.sizes[dim]):
                merged = merged.fillna(values.isel({dim: k}))
            values = merged
        else:
            raise SoundingError(
                f"has {values.sizes[dim]} entries along '{dim}'; choose one of them and write the file anew", file=file
            )
    missing = [name for name in kept[:2] if name not in values.dims]
    return values.expand_dims(missing) if missing else values


def _at_place(
    values: xr.DataArray,
    place: dict[str, str],
    latitude: float | None,
    longitude: float | None,
    point: Point,
    file: Path,
) -> xr.DataArray:
    for what, wanted in (("latitude", latitude), ("longitude", longitude)):
        name = place[what]
        if name not in values.dims:
            continue
        axis = values[name].values.astype(float)
        if wanted is None:
            if axis.size > 1:
                raise SoundingError(
                    f"covers {what}s from {axis.min():g} to {axis.max():g} deg; say which with {what}=", file=file
                )
            values = values.isel({name: 0})
            continue
        at = float(wanted)
        if what == "longitude":
            at = next((at + turn for turn in (0.0, 360.0, -360.0) if axis.min() <= at + turn <= axis.max()), at)
        if not axis.min() <= at <= axis.max():
            raise SoundingError(
                f"covers {what}s from {axis.min():g} to {axis.max():g} deg, and {wanted:g} deg is not among them",
                file=file,
            )
        if point == "nearest":
            values = values.isel({name: int(np.argmin(np.abs(axis - at)))})
        else:
            order = np.argsort(axis)
            low = int(np.clip(np.searchsorted(axis[order], at, side="right") - 1, 0, max(axis.size - 2, 0)))
            a, b = order[low], order[min(low + 1, axis.size - 1)]
            share = 0.0 if a == b else (at - axis[a]) / (axis[b] - axis[a])
            part = values.isel({name: int(a)}, drop=True) * (1 - share) + values.isel({name: int(b)}, drop=True) * share
            values = part.assign_coords({name: at})
    return values
