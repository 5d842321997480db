"""The generated files in the repository are what the code generator writes today, for every shipped vehicle."""

from __future__ import annotations

from pathlib import Path

import pytest

from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners import Study
from ascentwind.runners.cli.regenerate import generated_files

FOLDER = Path(__file__).parents[2] / "generated"


@pytest.mark.parametrize("vehicle", built_in_vehicles())
def test_generated_files_are_up_to_date(vehicle):
    stale = f"generated/{vehicle} is out of date: run 'ascentwind regenerate' and look at the difference"
    for name, text in generated_files(Study.load(vehicle, compile=False).system).items():
        assert (FOLDER / vehicle / name).read_text() == text, stale
