"""Turbulence in flight time: the spectra of model/wind/turbulence.py as states that a noise of their own drives.

z' = hdot A z / L + sqrt(hdot / L) B n and sigma(h) C z over altitude; its first-order high pass v' = hdot w (C z - v),
w = 2 pi over the wavelength, leaves sigma(h) (C z - v). Length and wavelength are parameters, sigma is a table.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ..system.symbols import ParameterSymbols, TableSymbols
from ..wind.turbulence import INTENSITY, Turbulence, realisation, stationary_covariance
from .wind import WindBlock


@dataclass(frozen=True, eq=False)
class TurbulenceNumbers:
    """Parameters of a vehicle's turbulence as symbols: length scale (m), factor on sigma, and what is asked for."""

    length: ca.SX
    sigma_scale: ca.SX
    high_pass: ca.SX | None
    correlation: ca.SX | None

    @staticmethod
    def of(turbulence: Turbulence, parameters: ParameterSymbols) -> TurbulenceNumbers:
        """Declare the parameters."""
        high_pass = correlation = None
        length = parameters.add("turbulence.length", turbulence.length, "m", "length scale L of turbulence")
        sigma_scale = parameters.add("turbulence.sigma_scale", 1.0, "1", "factor on turbulence's standard deviation")
        if turbulence.high_pass is not None:
            meaning = "wavelength above which turbulence is left to the wind's statistics"
            high_pass = parameters.add("turbulence.high_pass", turbulence.high_pass, "m", meaning)
        if turbulence.correlation is not None:
            meaning = "of turbulence's noise with the first noise of the wind's filter"
            correlation = parameters.add("turbulence.correlation", turbulence.correlation, "1", meaning)
        return TurbulenceNumbers(length, sigma_scale, high_pass, correlation)


def turbulence_block(
    turbulence: Turbulence, numbers: TurbulenceNumbers, tables: TableSymbols, rate: ca.SX, of_wind: ca.SX
) -> WindBlock:
    """Return turbulence in flight time.

    Parameters
    ----------
    turbulence, numbers
    tables : TableSymbols
    rate : SX
        Of climb, m/s.
    of_wind : SX
        First white noise of the wind's filter, for a correlation.
    """
    A, B, C = (ca.DM(x) for x in realisation(turbulence.form))
    z, own = ca.SX.sym("turbulence", turbulence.order), ca.SX.sym("white_turbulence")
    white = own
    if numbers.correlation is not None:
        white = numbers.correlation * of_wind + ca.sqrt(1 - numbers.correlation**2) * own
    inner = z[: A.shape[0]]
    wave = C.T @ inner
    derivative = rate / numbers.length * (A @ inner) + ca.sqrt(rate / numbers.length) * (B * white)
    if numbers.high_pass is not None:
        low = z[A.shape[0]]
        derivative = ca.vertcat(derivative, rate * _corner(numbers) * (wave - low))
    wave = ca.DM(turbulence.row).T @ z
    return WindBlock(z, derivative, own, (numbers.sigma_scale * tables[INTENSITY] * wave,))


def start_covariance(turbulence: Turbulence, numbers: TurbulenceNumbers) -> ca.SX:
    """Return the covariance of the states at the start, (n, n): that of a flight through turbulence forever."""
    A, _, C = realisation(turbulence.form)
    inner = ca.SX(ca.DM(stationary(turbulence.form)))
    if numbers.high_pass is None:
        return inner
    corner, row = _corner(numbers), inner @ ca.DM(C)
    cross = corner * ca.solve(corner * ca.SX.eye(row.numel()) - ca.DM(A) / numbers.length, row)
    return ca.blockcat([[inner, cross], [cross.T, ca.DM(C).T @ cross]])


def stationary(form: str) -> np.ndarray:
    """Return the stationary covariance of a form's states, (n, n): the same for any length."""
    A, B, _ = realisation(form)
    return stationary_covariance(A, B)


def _corner(numbers: TurbulenceNumbers) -> ca.SX:
    assert numbers.high_pass is not None
    return 2 * np.pi / numbers.high_pass
