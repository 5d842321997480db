"""Measured winds: balloons and fields in the formats that people have, one reading code, and their statistics."""
