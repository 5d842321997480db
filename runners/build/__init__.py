<<<<<<< HEAD
"""From what a vehicle is built of to the tables that its model reads."""
=======
"""From construction to tables: mean flight, mass properties, beam modes, slosh, aerodynamics, loads."""
>>>>>>> main
