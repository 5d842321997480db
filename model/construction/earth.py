"""The Earth: WGS 84 ellipsoid, its rotation, and gravity with the oblateness term J2.

Inertial frame: origin at the Earth's centre, z along the axis of rotation, x in the site's meridian at platform
release. Constants: World Geodetic System 1984 (NIMA TR8350.2, third edition, tables 3.1 and 3.3 and J2 = -sqrt(5) C20).
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

EQUATORIAL_RADIUS = 6378137.0  # m
FLATTENING = 1 / 298.257223563
GRAVITATIONAL_PARAMETER = 3.986004418e14  # m3/s2
J2 = 1.0826298e-3
ROTATION_RATE = 7.292115e-5  # rad/s

_POLAR_RADIUS = EQUATORIAL_RADIUS * (1 - FLATTENING)
_ECCENTRICITY2 = FLATTENING * (2 - FLATTENING)


def site_position(latitude: float, altitude: float) -> NDArray[np.float64]:
    """Return the Earth-fixed position (m), x in the site's meridian.

    Parameters
    ----------
    latitude : float
        Geodetic, rad.
    altitude : float
        Above the ellipsoid, m.
    """
    normal_radius = EQUATORIAL_RADIUS / np.sqrt(1 - _ECCENTRICITY2 * np.sin(latitude) ** 2)
    return np.array(
        [
            (normal_radius + altitude) * np.cos(latitude),
            0.0,
            (normal_radius * (1 - _ECCENTRICITY2) + altitude) * np.sin(latitude),
        ]
    )


def plumbline_axes(latitude: float, azimuth: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the unit vectors up (along the plumb line, taken as the ellipsoid's normal) and downrange at the site."""
    up = np.array([np.cos(latitude), 0.0, np.sin(latitude)])
    north, east = np.array([-np.sin(latitude), 0.0, np.cos(latitude)]), np.array([0.0, 1.0, 0.0])
    return up, np.cos(azimuth) * north + np.sin(azimuth) * east


def rotation_about_pole(angle: ca.MX | float) -> ca.MX:
    """Return the matrix that turns a vector about the Earth's axis by an angle (rad)."""
    cos, sin = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(cos, -sin, 0), ca.horzcat(sin, cos, 0), ca.horzcat(0, 0, 1))


def gravity(position: ca.MX) -> ca.MX:
    """Return the acceleration (m/s2) of gravitation with J2 at an inertial position (m)."""
    r = ca.norm_2(position)
    z2 = (position[2] / r) ** 2
    oblateness = 1.5 * J2 * (EQUATORIAL_RADIUS / r) ** 2
    factors = 1 + oblateness * (ca.vertcat(1, 1, 3) - 5 * z2)
    return -GRAVITATIONAL_PARAMETER / r**3 * factors * position


def geodetic(position: ca.MX) -> tuple[ca.MX, ca.MX]:
    """Return altitude above the ellipsoid (m) and the unit vector of its normal, by Bowring's formula.

    One step of it errs by less than a micrometre below 100 km (Bowring, Survey Review 23, 1976).
    """
    distance, z = ca.norm_2(position[:2]), position[2]
    parametric = ca.atan2(z * EQUATORIAL_RADIUS, distance * _POLAR_RADIUS)
    second_eccentricity2 = _ECCENTRICITY2 / (1 - _ECCENTRICITY2)
    latitude = ca.atan2(
        z + second_eccentricity2 * _POLAR_RADIUS * ca.sin(parametric) ** 3,
        distance - _ECCENTRICITY2 * EQUATORIAL_RADIUS * ca.cos(parametric) ** 3,
    )
    cos, sin = ca.cos(latitude), ca.sin(latitude)
    altitude = distance * cos + z * sin - EQUATORIAL_RADIUS * ca.sqrt(1 - _ECCENTRICITY2 * sin**2)
    return altitude, ca.vertcat(cos * position[:2] / distance, sin)
