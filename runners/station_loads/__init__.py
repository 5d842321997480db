"""Loads at the stations of a vehicle: bending moment, shear force and axial force along it."""
