"""Relative deviations of vehicle tables (thrust, centre of pressure) as noise: report 4.1.5 and 4.1.6.

A deviation multiplies every term of the named tables at its mean value; the coefficients are the derivative of the
equations with respect to a common factor on those tables, taken at the mean angle of attack, engine angle and
attitude. The report calls the deviations white with a one sigma in percent, which has no finite meaning; here a
deviation is sigma times a first-order Gauss-Markov process of unit variance,

    n' = -n / tau + sqrt(2 / tau) w,

or, as an option, sigma times white noise of unit intensity.

A bias is sigma times a constant of unit variance, n' = 0: the flight's, random from flight to flight.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ..system.symbols import ParameterSymbols
from ..vehicle.biases import Bias
from ..vehicle.vehicle_file import NoiseEntry
from .block import Block

DEVIATION = "deviation"  # the block of their states


@dataclass(frozen=True)
class NoiseProcess:
    """A deviation: its states (none or one), their derivative, and the deviation itself, in its unit."""

    state: ca.SX
    derivative: ca.SX
    white: ca.SX
    deviation: ca.SX


def deviation_block(name: str, process: NoiseProcess) -> Block:
    """Return the state of a noise source, where it is coloured."""
    names = [f"{DEVIATION}_{name}"] * process.state.numel()
    return Block.of(DEVIATION, process.state, process.derivative, names=names)


def noise_process(name: str, entry: NoiseEntry, parameters: ParameterSymbols) -> NoiseProcess:
    """Declare the parameters of a noise source and return its process."""
    sigma = parameters.add(f"{name}.sigma", entry.sigma, "1", f"one sigma of the relative deviation of {name}")
    white = ca.SX.sym(f"white_{name}")
    if entry.white:
        return NoiseProcess(ca.SX(0, 1), ca.SX(0, 1), white, sigma * white)
    tau = parameters.add(f"{name}.correlation_time", entry.correlation_time_s, "s", f"correlation time of {name}")
    state = ca.SX.sym(f"deviation_{name}")
    return NoiseProcess(state, -state / tau + ca.sqrt(2 / tau) * white, white, sigma * state)


def bias_process(bias: Bias, parameters: ParameterSymbols) -> NoiseProcess:
    """Declare the parameter of a bias and return its process.

    Sources are known by their white noises; that of a bias enters nothing.
    """
    meaning = f"one sigma of {bias.source}, constant over a flight"
    sigma = parameters.add(f"{bias.source}.standard_deviation", bias.standard_deviation, bias.unit, meaning)
    state = ca.SX.sym(f"{DEVIATION}_{bias.source}")
    return NoiseProcess(state, ca.SX.zeros(1), ca.SX.sym(f"white_{bias.source}"), sigma * state)
