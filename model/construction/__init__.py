"""What a vehicle is built of: masses, tanks, stiffness, aerodynamics, engines, programme, site."""

from .construction import Construction as Construction
