"""NetCDF files after the CF conventions: one unit a variable, so that plain xarray, pint and others read them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import ScipyDataStore

from .files import write_whole

CONVENTIONS = "CF-1.11"
RULE = "unit_rule"  # attribute: unit of a variable whose entries have their own, in words that are its dimensions
FACTOR = re.compile(r"(?P<name>[^\W\d]+|%|°)(\^?(?P<power>-?\d+(\.\d+)?))?")


def unit_factors(text: str) -> dict[str, float]:
    """Return the powers of a unit's factors, 'm/s2' as {'m': 1, 's': -2}; what is no such product is one factor."""
    found: dict[str, float] = {}
    sign = 1
    for token in re.findall(r"/|[^\s/*·]+", re.sub(r"sqrt\(([^\W\d]+)\)", r"\1^0.5", text)):
        if token == "/":
            sign = -1
            continue
        if token != "1":
            factor = FACTOR.fullmatch(token)
            if factor is None:
                return {text: 1.0}
            found[factor["name"]] = found.get(factor["name"], 0.0) + sign * float(factor["power"] or 1)
        sign = 1
    return found


def written_unit(factors: Mapping[str, float]) -> str:
    """Return a unit as UDUNITS and pint both read it: 'N m', 'm s^-2'; pint alone reads 's^-0.5'."""
    parts = []
    for name, power in factors.items():
        if power:
            whole = name if FACTOR.fullmatch(name) or power == 1 else f"({name})"
            parts.append(whole if power == 1 else f"{whole}^{power:g}")
    return " ".join(parts) or "1"


def unit_by_rule(rule: str, entries: Mapping[str, str]) -> str:
    """Return the unit of an entry: in the rule 'response^2 s^-1' the word 'response' stands for that entry's unit."""
    found: dict[str, float] = {}
    for word, power in unit_factors(rule).items():
        for name, of_entry in (unit_factors(entries[word]) if word in entries else {word: 1.0}).items():
            found[name] = found.get(name, 0.0) + power * of_entry
    return written_unit(found)


def variable_name(text: str) -> str:
    """Return a name of letters, digits and underscores, as CF asks."""
    name = re.sub(r"\W+", "_", text).strip("_") or "variable"
    return name if name[0].isalpha() else f"_{name}"


def one_unit_a_variable(
    dataset: xr.Dataset, units: Mapping[str, Sequence[str]], words: Mapping[str, str] | None = None
) -> xr.Dataset:
    """Return a dataset in which every entry along some dimensions is a variable with its own unit.

    ``std`` (time, response, source) becomes ``bending_moment_std`` (time, source), ``angle_of_attack_std`` and so on.
    The attributes ``quantity``, ``whole_dimensions`` and, for each dimension that went, its label and ``..._unit`` say
    where a variable comes from; :func:`joined` puts it back. Of a covariance between responses, which is symmetric, one
    triangle is written.

    Parameters
    ----------
    dataset : xarray.Dataset
        A variable has either ``units``, or ``unit_rule``, a product of units and names of its dimensions.
    units : mapping of dimension to sequence of str
        The unit of each entry.
    words : mapping of str to str, optional
        Units that other words of rules stand for. With it only variables that have a rule are split.
    """
    variables: dict[str, xr.Variable] = {}
    for quantity, values in dataset.data_vars.items():
        split = [d for d in values.dims if d in units]
        if not split or (words is not None and RULE not in values.attrs):
            _add(variables, str(quantity), values.variable)
            continue
        symmetric = len(split) == 2 and list(dataset[split[0]].values) == list(dataset[split[1]].values)
        for at in product(*(range(values.sizes[d]) for d in split)):
            if symmetric and at[0] > at[1]:
                continue
            index = dict(zip(split, at, strict=True))
            labels = {str(d): str(dataset[d].values[i]) for d, i in index.items()}
            own = {str(d): units[str(d)][i] for d, i in index.items()}
            part = values.variable.isel(index)
            part.attrs = dict(values.attrs) | labels | {f"{d}_unit": unit for d, unit in own.items()}
            part.attrs |= {"quantity": str(quantity), "whole_dimensions": " ".join(map(str, values.dims))}
            if RULE in values.attrs:
                part.attrs["units"] = unit_by_rule(values.attrs[RULE], own | dict(words or {}))
            meaning = values.attrs.get("long_name", str(quantity))
            part.attrs["long_name"] = f"{meaning}: {', '.join(labels.values())}"
            _add(variables, f"{'_'.join(labels.values())}_{quantity}", part)
    gone = {d for d in units if not any(d in v.dims for v in variables.values())}
    kept = {name: c.variable for name, c in dataset.coords.items() if not set(c.dims) & gone}
    return xr.Dataset(variables, kept, dataset.attrs)


def _add(variables: dict[str, xr.Variable], wanted: str, variable: xr.Variable) -> None:
    name, again = variable_name(wanted), 2
    while name in variables:
        name, again = f"{variable_name(wanted)}_{again}", again + 1
    variables[name] = variable


def joined(dataset: xr.Dataset) -> xr.Dataset:
    """Return the dataset from which :func:`one_unit_a_variable` made ``dataset``."""
    groups: dict[str, list[xr.Variable]] = {}
    whole: dict[Any, Any] = {}
    for name, values in dataset.data_vars.items():
        if "quantity" in values.attrs and "whole_dimensions" in values.attrs:
            groups.setdefault(values.attrs["quantity"], []).append(values.variable)
        else:
            whole[name] = values.variable
    labels: dict[str, list[str]] = {}
    for quantity, parts in groups.items():
        dims = parts[0].attrs["whole_dimensions"].split()
        split = [d for d in dims if d in parts[0].attrs and d not in parts[0].dims]
        for d in split:
            labels.setdefault(d, list(dict.fromkeys(p.attrs[d] for p in parts)))
        shape = [len(labels[d]) for d in split]
        values, filled = np.empty(shape + list(parts[0].shape), parts[0].dtype), np.zeros(shape, bool)
        for part in parts:
            at = tuple(labels[d].index(part.attrs[d]) for d in split)
            for place in (at, at[::-1]) if len(split) == 2 and labels[split[0]] == labels[split[1]] else (at,):
                values[place], filled[place] = part.values, True
        if not filled.all():
            raise ValueError(f"a part of '{quantity}' is missing")
        dropped = {"quantity", "whole_dimensions", *split, *(f"{d}_unit" for d in split)}
        attributes = {k: v for k, v in parts[0].attrs.items() if k not in dropped}
        if RULE in attributes:
            attributes.pop("units", None)
        told = ", ".join(parts[0].attrs[d] for d in split)
        if "long_name" in attributes:
            attributes["long_name"] = attributes["long_name"].removesuffix(f": {told}")
        whole[quantity] = xr.Variable([*split, *parts[0].dims], values, attributes).transpose(*dims)
    found = xr.Dataset(whole, {n: c.variable for n, c in dataset.coords.items()}, dataset.attrs)
    return found.assign_coords(labels)


def write_netcdf(dataset: xr.Dataset, path: Path) -> Path:
    """Write a dataset whole, with ``Conventions`` and ``history``.

    Raises
    ------
    OutputFolderError
    """
    return write_whole(path, lambda p: _write(with_conventions(dataset), p))


def _write(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset as ``to_netcdf`` does, which imports Dask with its cluster besides: 0.4 s."""
    with ScipyDataStore(str(path), mode="w", lock=False) as store:
        dataset.dump_to_store(store)


def with_conventions(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset with CF's global attributes; the history has no date, so that equal numbers make equal files."""
    version, engine = dataset.attrs.get("ascentwind", ""), dataset.attrs.get("engine")
    history = f"ascentwind {version}".strip() + (f": {engine}" if engine else "")
    return dataset.assign_attrs({"Conventions": CONVENTIONS, "history": history})
