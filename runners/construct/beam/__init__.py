"""The free beam: elements, modes, and modes followed through flight."""
