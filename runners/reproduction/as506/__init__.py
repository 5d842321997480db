"""The flight of AS-506 (Apollo 11) beside what is computed: trajectory, masses, loads."""
