"""A made-up vehicle of 30 m for tests of the build: two stages, one tank, three parts of the normal force."""

from __future__ import annotations

import numpy as np

from ascentwind.model.construction import Construction
from ascentwind.model.construction.flight import Drag, EngineGroup, NormalForceComponent, PitchProgramme, Site
from ascentwind.model.construction.structure import LumpedMass, Stiffness, Tank, TankSection

MACH = np.array([0.0, 1.0, 2.0, 5.0])


def small_construction(**changes) -> Construction:
    parts = {
        "name": "small",
        "gimbal_station": 2.0,
        "sensor_station": 24.0,
        "aft_end": 0.0,
        "forward_end": 30.0,
        "reference_area": 3.0,
        "masses": (
            LumpedMass("engines", 0.0, 3.0, 900.0, 0.5),
            LumpedMass("shell", 2.0, 22.0, 2500.0, 0.9),
            LumpedMass("upper", 22.0, 30.0, 3000.0),
            LumpedMass("box", 24.0, 24.0, 150.0),
        ),
        "tanks": (Tank("oxidizer", (TankSection("cylinder", 5.0, 15.0, 0.9),), 1100.0, 20000.0, True),),
        "stiffness": Stiffness(np.array([0.0, 30.0]), np.array([4e8, 1e8]), np.array([3e8, 1e8])),
        "bending_modes": 2,
        "normal_force": (
            NormalForceComponent(
                "nose",
                np.array([25.0, 27.0, 30.0]),
                np.array([1.0, 2.0, 0.0]),
                MACH,
                np.array([1.8, 2.0, 2.2, 2.2]),
            ),
            NormalForceComponent(
                "flare",
                np.array([20.0, 22.0]),
                np.array([1.0, 1.0]),
                MACH,
                np.array([0.5, 0.7, 0.6, 0.5]),
            ),
            NormalForceComponent(
                "fins",
                np.array([1.0, 4.0]),
                np.array([0.5, 1.5]),
                MACH,
                np.array([0.8, 1.0, 0.7, 0.3]),
            ),
        ),
        "drag": Drag(np.array([0.0, 5.0]), np.array([0.4, 0.3])),
        "engines": (
            EngineGroup("main", 1, True, 0.5, np.array([0.0, 100.0]), np.full(2, 4e5), np.full(2, 140.0),
                        {"oxidizer": 0.7}, None, "main_engine_cutoff", {"oxidizer": 200.0}),
        ),
        "pitch": PitchProgramme(
            "table", 0.0, 5.0, 90.0, np.zeros((0, 7)), np.array([0.0, 10.0, 90.0]), np.array([0.0, 0.0, 1.0])
        ),
        "site": Site(0.5, 1.6, 10.0, -1.0, 0.0),
        "atmosphere": None,
        "load_stations": (12.0,),
        "end_time": 90.0,
    }  # fmt: skip
    return Construction(**(parts | changes))
