"""From construction to tables: mean flight, mass properties, beam modes, slosh, aerodynamics, loads."""
