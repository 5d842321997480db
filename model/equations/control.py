"""Control law and its networks: equations 4-4 to 4-7.

beta = T3(s) { K1 T1(s) phi_m + K2 T2(s) phidot_m } + sum_j Y'_j(X_E) eta_j
phi_m = phi_Z + sum_j Y'_j(X_M) eta_j, and phidot_m likewise.

The report's error signals carry a minus that the lost figure 4-4 undoes once more: with 4-2 as printed only this
sign closes the loop stably. K1, K2 are the factors of the gain schedule; they act behind the networks.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ..system.symbols import ParameterSymbols
from ..vehicle.vehicle_file import TransferFunctionEntry


@dataclass(frozen=True)
class TransferFunction:
    """A transfer function as states: their derivative and the output."""

    states: ca.SX
    derivative: ca.SX
    output: ca.SX


def transfer_function_symbols(
    name: str, entry: TransferFunctionEntry, parameters: ParameterSymbols, gain: float = 1.0, unit: str = "1"
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Declare gain, numerator and denominator of a transfer function as parameters.

    Parameters
    ----------
    name : str
    entry : TransferFunctionEntry
    parameters : ParameterSymbols
    gain, unit : float, str
        Value and unit of the gain.

    Returns
    -------
    gain, numerator, denominator : SX
        Coefficients in descending powers; those that are zero in the data stay zero.
    """
    factor = parameters.add(f"control.{name}.gain", gain, unit, f"factor on {name}(s)")

    def symbols(kind: str, values: tuple[float, ...]) -> ca.SX:
        return ca.vertcat(
            *(
                parameters.add(f"control.{name}.{kind}.s{power}", value, "1", f"{name}: coefficient of s^{power}")
                if value
                else ca.SX(0)
                for power, value in zip(reversed(range(len(values))), values, strict=True)
            )
        )

    return factor, symbols("numerator", entry.numerator), symbols("denominator", entry.denominator)


def transfer_function(name: str, gain: ca.SX, numerator: ca.SX, denominator: ca.SX, signal: ca.SX) -> TransferFunction:
    """Realise gain N(s)/D(s) acting on ``signal`` in scaled companion form.

    The k-th state is the (k-1)-th derivative over w0^(k-1), w0 the geometric mean of the poles, so that all states
    have the size of the signal and the coefficients in A stay near the poles: for T1 612 where the plain form has
    17529 and the largest pole is 52 rad/s.
    """
    n = denominator.numel() - 1
    a = denominator / denominator[0]
    b = ca.vertcat(ca.SX.zeros(n + 1 - numerator.numel()), numerator) / denominator[0]
    if n == 0:
        return TransferFunction(ca.SX(0, 1), ca.SX(0, 1), gain * b[0] * signal)
    lowest = max(k for k in range(n + 1) if not a[k].is_zero())
    w0 = ca.fabs(a[lowest]) ** (1.0 / lowest) if lowest else ca.SX(1)
    x = ca.SX.sym(name, n)
    last = signal - sum((a[n - k] / w0 ** (n - k) * x[k] for k in range(n)), ca.SX(0))
    derivative = w0 * ca.vertcat(*(x[k] for k in range(1, n)), last)
    direct = b[0]
    output = direct * signal + sum(((b[n - k] - direct * a[n - k]) / w0 ** (n - k) * x[k] for k in range(n)), ca.SX(0))
    return TransferFunction(x, derivative, gain * output)
