"""The standard atmosphere against the package ambiance, and against the printed tables of 1976."""

from __future__ import annotations

import ambiance
import numpy as np
import pytest

from ascentwind.model.standard_atmosphere import GAS_CONSTANT, HIGHEST, LOWEST, standard_air


def test_air_is_that_of_another_program():
    altitude = np.concatenate([np.linspace(LOWEST, HIGHEST, 2001), [0.0, 11_019.1, 20_063.1, 47_350.1]])
    density, temperature = standard_air(altitude)
    expected = ambiance.Atmosphere(altitude)
    np.testing.assert_allclose(density, expected.density, rtol=1e-13)
    np.testing.assert_allclose(temperature, expected.temperature, rtol=1e-14)


@pytest.mark.parametrize(
    ("altitude", "kelvin", "pascal"),
    # U.S. Standard Atmosphere 1976, table I, geometric altitude
    [(0.0, 288.150, 1.01325e5), (10e3, 223.252, 2.6499e4), (30e3, 226.509, 1.1970e3), (60e3, 247.021, 2.1958e1)],
)
def test_air_is_that_of_the_printed_table(altitude, kelvin, pascal):
    density, temperature = standard_air(altitude)
    assert temperature == pytest.approx(kelvin, abs=1e-3)
    assert density * GAS_CONSTANT * temperature == pytest.approx(pascal, rel=1e-4)
