"""A 13-state launcher by numbers: rigid body and bending from a published table, all else made up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

# not ours to ship: digitised from Greensite's example by others, who state no licence
TABLE = Path(__file__).parents[3] / "shared" / "data" / "vehicle" / "greensite_example_lpv.csv"
STATES = (
    "pitch", "pitch_rate", "drift_rate", "bending", "bending_rate", "engine", "engine_rate", "attitude_integral",
    "gyro", "notch", "notch_rate", "gust", "gust_lag",
)  # fmt: skip
FIRST, LAST = 10.0, 90.0  # s
BENDING_DAMPING, ENGINE_FREQUENCY, ENGINE_DAMPING, GYRO = 0.01, 70.0, 0.7, 50.0
PROPORTIONAL, RATE, INTEGRAL = 1.1, 0.9, 0.05
NOTCH_FREQUENCY, NOTCH_DEPTH, NOTCH_WIDTH = 18.0, 0.1, 0.7
GUST, GUST_LENGTH = 2.0, 500.0  # m/s, m


def launcher() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return times (k,), A (k, 13, 13), B (k, 13, 2) and C (3, 13)."""
    table = pd.read_csv(TABLE, comment="#")
    table = table.loc[(table["time"] >= FIRST) & (table["time"] <= LAST)]
    at = {name: i for i, name in enumerate(STATES)}
    found = [(_state_matrix(row, at), _noise_matrix(row, at)) for row in table.to_dict("records")]
    A, B = (np.array(matrices) for matrices in zip(*found, strict=True))
    C = np.zeros((3, len(STATES)))
    C[0, at["pitch"]] = C[1, at["engine"]] = C[2, at["bending"]] = 1.0
    return table["time"].to_numpy(float), A, B, C


def _state_matrix(row: dict, at: dict[str, int]) -> NDArray[np.float64]:
    A = np.zeros((len(STATES), len(STATES)))

    def put(state: str, **effects: float) -> None:
        for other, value in effects.items():
            A[at[state], at[other]] += value

    speed, omega = row["V"], row["omega"]
    alpha = {"pitch": 1.0, "drift_rate": 1 / speed, "gust": -1 / speed}  # angle of attack
    put("pitch", pitch_rate=1.0)
    put("pitch_rate", engine=row["K1"], **{n: row["A6"] * x for n, x in alpha.items()})
    put("drift_rate", engine=row["a3"], pitch=row["a4"], **{n: row["a1"] * x for n, x in alpha.items() if n != "pitch"})
    put("bending", bending_rate=1.0)
    put("bending_rate", bending=-(omega**2), bending_rate=-2 * BENDING_DAMPING * omega, engine=row["-phi_tvc*Tc"])
    put("attitude_integral", pitch=1.0, bending=-row["sigma_ins"])
    put("gyro", gyro=-GYRO, pitch_rate=GYRO, bending_rate=-GYRO * row["sigma_ins"])
    put("notch", notch_rate=1.0)  # (s^2 + 2 d w s + w^2) / (s^2 + 2 b w s + w^2) of the command before it
    put("notch_rate", notch=-(NOTCH_FREQUENCY**2), notch_rate=-2 * NOTCH_WIDTH * NOTCH_FREQUENCY)
    command = {
        "pitch": -PROPORTIONAL,
        "bending": PROPORTIONAL * row["sigma_ins"],
        "gyro": -RATE,
        "attitude_integral": -INTEGRAL,
    }
    put("notch_rate", **command)
    after = command | {"notch_rate": -2 * (NOTCH_WIDTH - NOTCH_DEPTH) * NOTCH_FREQUENCY}
    put("engine", engine_rate=1.0)
    put("engine_rate", engine=-(ENGINE_FREQUENCY**2), engine_rate=-2 * ENGINE_DAMPING * ENGINE_FREQUENCY)
    put("engine_rate", **{name: ENGINE_FREQUENCY**2 * value for name, value in after.items()})
    rate = speed / GUST_LENGTH  # Dryden: sqrt(3) rate gust_lag' and a second lag
    put("gust", gust=-rate, gust_lag=1.0)
    put("gust_lag", gust_lag=-rate)
    return A


def _noise_matrix(row: dict, at: dict[str, int]) -> NDArray[np.float64]:
    B = np.zeros((len(STATES), 2))
    rate = row["V"] / GUST_LENGTH
    B[at["gust"], 0] = GUST * np.sqrt(3 * rate)
    B[at["gust_lag"], 0] = GUST * np.sqrt(rate) * rate * (1 - np.sqrt(3))
    B[at["gyro"], 1] = 1e-4 * GYRO
    return B
