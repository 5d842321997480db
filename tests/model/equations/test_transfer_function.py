"""The scaled companion realisation of T1, T2, T3 against the polynomials themselves."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from ascentwind.model.equations.control import transfer_function, transfer_function_symbols
from ascentwind.model.system.symbols import ParameterSymbols
from ascentwind.model.vehicle.vehicle_file import TransferFunctionEntry

CASES = {
    "T1": ((37.63, 479.54, 7440.6, 739.3), (1.0, 93.25, 2481.63, 17528.8, 821.44)),
    "T2": (
        (11.30311, 48.225, 6065.15, 7429.85, 498784.0),
        (1.0, 147.73, 6324.4, 90258.0, 462383.0, 722876.0),
    ),
    "T3": ((1188.87,), (1.0, 29.9286, 1188.87)),
    "feedthrough": ((2.0, 3.0, -5.0), (4.0, 7.0, 11.0)),
    "pole_at_zero": ((0.3, 2.0), (1.0, 5.0, 0.0)),
    "two_poles_at_zero": ((1.5,), (2.0, 0.0, 0.0)),
    "lag": ((3.0,), (0.5, 2.0)),
    "constant": ((3.0,), (2.0,)),
}


def realise(name, gain):
    """Return A, B, C, D of ``gain`` times a case."""
    parameters, signal = ParameterSymbols(), ca.SX.sym("signal")
    numerator, denominator = CASES[name]
    entry = TransferFunctionEntry(numerator=numerator, denominator=denominator)
    T = transfer_function(name, *transfer_function_symbols(name, entry, parameters), signal)
    blocks = [ca.densify(ca.jacobian(of, by)) for of in (T.derivative, T.output) for by in (T.states, signal)]
    values = [gain if p.name == f"control.{name}.gain" else p.value for p in parameters.parameters]
    return [m.full() for m in ca.Function("matrices", [parameters.vector], blocks).call([ca.DM(values)])]


@pytest.mark.parametrize("name", CASES)
def test_frequency_response_is_the_ratio_of_the_polynomials(name):
    A, B, C, D = realise(name, gain=0.7)
    assert A.shape[0] == len(CASES[name][1]) - 1
    for w in np.logspace(-3, 3, 25):
        s = 1j * w
        found = (C @ np.linalg.solve(s * np.eye(A.shape[0]) - A, B) + D)[0, 0]
        expected = 0.7 * np.polyval(CASES[name][0], s) / np.polyval(CASES[name][1], s)
        assert abs(found - expected) <= 1e-12 * abs(expected), w


@pytest.mark.parametrize("name", ["T1", "T2", "T3"])
def test_poles_are_the_roots_and_scaling_keeps_entries_of_their_size(name):
    A = realise(name, gain=1.0)[0]
    roots = np.sort_complex(np.roots(CASES[name][1]))
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(A)), roots, rtol=1e-9)
    assert np.abs(A).max() < 15 * np.abs(roots).max()
    assert np.abs(A).max() < 0.05 * max(CASES[name][1])  # the largest entry without scaling


def test_first_stage_gains_are_the_static_gains():
    for name, gain in (("T1", 0.90), ("T2", 0.69), ("T3", 1.0)):
        A, B, C, D = realise(name, gain=1.0)
        assert (D - C @ np.linalg.solve(A, B))[0, 0] == pytest.approx(gain, abs=5e-4)
