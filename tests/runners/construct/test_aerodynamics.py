"""Normal force along a vehicle: against direct quadrature, and refusals."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from small_construction import small_construction

from ascentwind.model.construction.flight import NormalForceComponent
from ascentwind.model.errors import DataError
from ascentwind.runners.construct.aerodynamics import intensity, local_normal_force, normal_force


def test_slope_and_center_of_pressure_by_quadrature():
    """Force and first moment of the local intensity, integrated by SciPy, are C_N_alpha and its centre of pressure."""
    construction = small_construction()
    for mach in (0.0, 0.5, 1.3, 4.9):
        knots = sorted({s for c in construction.normal_force for s in c.station})

        def local(station, mach=mach):
            total = 0.0
            for c in construction.normal_force:
                area = np.trapezoid(c.shape, c.station)
                inside = np.interp(station, c.station, c.shape, left=0, right=0)
                total += np.interp(mach, c.mach, c.slope) * inside / area
            return total

        pieces = list(pairwise(knots))
        force = sum(quad(local, a, b)[0] for a, b in pieces)
        moment = sum(quad(lambda s, local=local: s * local(s), a, b)[0] for a, b in pieces)
        slope, center = normal_force(construction, [mach])
        assert slope[0] == pytest.approx(force, rel=1e-10)
        assert center[0] == pytest.approx(moment / force - construction.gimbal_station, rel=1e-10)


def test_elements_sum_to_the_whole_and_follow_the_intensity():
    construction = small_construction()
    mach, edges = np.array([0.3, 2.5]), np.linspace(-2, 28, 301)
    elements = local_normal_force(construction, mach, edges)
    np.testing.assert_allclose(elements.sum(axis=1), normal_force(construction, mach)[0], rtol=1e-12)
    middle = 0.5 * (edges[:-1] + edges[1:])
    np.testing.assert_allclose(elements, intensity(construction, mach, middle) * np.diff(edges), atol=1e-12)


def test_flight_beyond_the_mach_table_names_mach_part_and_time():
    construction = small_construction()
    with pytest.raises(DataError, match=r"t = 61 s: .*Mach 5\.5.*'nose' ends at Mach 5"):
        normal_force(construction, [1.0, 5.5], time=[20.0, 61.0])


def test_no_normal_force_and_a_vanishing_one_are_refused():
    with pytest.raises(DataError, match="add"):
        normal_force(small_construction(normal_force=()), [1.0])
    nothing = NormalForceComponent("a", np.array([1.0, 2.0]), np.ones(2), np.array([0.0, 9.0]), np.zeros(2))
    with pytest.raises(DataError, match="vanishes at Mach 1"):
        normal_force(small_construction(normal_force=(nothing,)), [1.0])
