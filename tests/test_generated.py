"""The generated files in the repository are what the code generator writes today."""

from __future__ import annotations

from pathlib import Path

from ascentwind.runners.regenerate import generated_files

FOLDER = Path(__file__).parent.parent / "generated" / "as504"


def test_generated_files_are_up_to_date(as504):
    stale = "generated/as504 is out of date: run 'ascentwind regenerate' and look at the difference"
    for name, text in generated_files(as504.system).items():
        assert (FOLDER / name).read_text() == text, stale
