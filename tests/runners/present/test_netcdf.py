"""Files with one unit a variable: what a unit is, what becomes of names, and that nothing is lost."""

import numpy as np
import pytest
import xarray as xr

from ascentwind.runners.present.netcdf import (
    RULE,
    joined,
    one_unit_a_variable,
    unit_by_rule,
    unit_factors,
    variable_name,
    written_unit,
)


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("N m", "N m"), ("m/s2", "m s^-2"), ("kg m2", "kg m^2"), ("1/m/rad", "m^-1 rad^-1"), ("1", "1"), ("", "1"),
        ("Pa rad", "Pa rad"), ("m2/rad", "m^2 rad^-1"), ("1/sqrt(m)", "m^-0.5"), ("m/m", "1"), ("% (MAC)", "% (MAC)"),
    ],
)  # fmt: skip
def test_units_of_tables_as_udunits_and_pint_write_them(text, written):
    assert written_unit(unit_factors(text)) == written


@pytest.mark.parametrize(
    ("rule", "unit"),
    [
        ("response", "N m"), ("response^2", "N^2 m^2"), ("response s^-0.5", "N m s^-0.5"),
        ("response table^-1 s^-1", "N m kg^-1 s^-1"), ("response other^-1", "N m (odd one!)^-1"), ("s", "s"),
    ],
)  # fmt: skip
def test_a_rule_takes_the_unit_of_an_entry(rule, unit):
    assert unit_by_rule(rule, {"response": "N m", "table": "kg", "other": "odd one!"}) == unit


@pytest.mark.parametrize(("text", "name"), [("a.b/c d", "a_b_c_d"), ("σ", "σ"), ("3rd", "_3rd"), ("../", "variable")])
def test_names_of_variables(text, name):
    assert variable_name(text) == name


def made(names: list[str]) -> xr.Dataset:
    n = len(names)
    random = np.random.default_rng(1)
    spread = random.normal(size=(2, n, n))
    both = {RULE: "response other_response"}
    return xr.Dataset(
        {
            "std": (("time", "response"), random.normal(size=(2, n)), {RULE: "response", "long_name": "sigma"}),
            "covariance": (("time", "response", "other_response"), spread + spread.swapaxes(1, 2), both),
            "at": ("response", np.arange(float(n)), {"units": "s"}),
            "steps": ("time", [3, 4]),
        },
        {"time": [1.0, 2.0], "response": names, "other_response": names},
        {"title": "made up"},
    )


@pytest.mark.parametrize("names", [["x"], ["moment", "angle"], ["a b", "a_b", "a.b"], ["x", "x_std", "std"]])
def test_nothing_is_lost_whatever_the_names(names):
    dataset = made(names)
    units = {"response": ["N m", "rad", "1"][: len(names)], "other_response": ["N m", "rad", "1"][: len(names)]}
    split = one_unit_a_variable(dataset, units)
    assert not {"response", "other_response"} & set(split.dims)
    assert len(split.data_vars) == 2 * len(names) + len(names) * (len(names) + 1) // 2 + 1
    again = joined(split)
    xr.testing.assert_equal(again, dataset)
    for name in dataset.data_vars:
        assert again[name].dims == dataset[name].dims
        assert dict(again[name].attrs) | {"long_name": ""} == dict(dataset[name].attrs) | {"long_name": ""}


def test_a_part_that_is_missing_is_told():
    split = one_unit_a_variable(made(["x", "y"]), {"response": ["N m", "rad"], "other_response": ["N m", "rad"]})
    with pytest.raises(ValueError, match="a part of 'covariance' is missing"):
        joined(split.drop_vars("x_y_covariance"))
