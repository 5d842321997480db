"""The outline: radius, the share of the drag forward of a station, and what contradicts it."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from ascentwind.model.construction.construction_file import load_construction
from ascentwind.model.construction.outline import Outline
from ascentwind.model.errors import DataError
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners.construct.build_vehicle import build_vehicle


def test_share_of_a_cone_on_a_cylinder_is_the_square_of_the_radius():
    """A cone of 4 m length and 2 m radius on a cylinder, and a flare of three times the area at a step."""
    outline = Outline(np.array([0.0, 3.0, 3.0, 10.0, 14.0]), np.array([2 * 3**0.5, 2 * 3**0.5, 2.0, 2.0, 0.0]))
    np.testing.assert_allclose(
        outline.drag_forward([14.0, 12.0, 10.0, 5.0, 3.0, 2.9, 0.0]), [0, 1 / 12, 1 / 3, 1 / 3, 1 / 3, 1, 1]
    )
    np.testing.assert_allclose(outline.at([14.0, 12.0, 5.0, 3.0, 2.9]), [0, 1, 2, 2, 2 * 3**0.5], atol=1e-5)


def test_what_narrows_aft_meets_no_air():
    """A ball's forward half takes all, and a blunt tip its own area."""
    s = np.linspace(-1, 1, 2001)
    ball = Outline(s, np.sqrt(1 - s**2))
    np.testing.assert_allclose(ball.drag_forward([0.5, 0.0, -0.9]), [0.75, 1.0, 1.0], atol=1e-6)
    blunt = Outline(np.array([0.0, 2.0]), np.array([2.0, 1.0]))
    assert blunt.drag_forward(1.999999) == pytest.approx(0.25, abs=1e-5)


@pytest.mark.parametrize(
    ("file", "old", "new", "why"),
    [
        ("construction/outline.csv", "107.696,0,", "107.0,0,", r"outline is given from -3\.048 to 107 m"),
        ("construction/outline.csv", "63.9826,5.0292", "63.9826,4.0", r"tank 's.*where the outline has"),
        ("construction/outline.csv", "107.696,0,", "107.696,-1,", "radius"),
        ("vehicle.toml", "radius_m = 5.0292", "radius_m = 5.0", r"loads\.0\.radius_m.*5\.0292 m at station 25 m"),
        ("construction.toml", "[outline]", "[outliner]", "outline"),
    ],
)
def test_contradictions_are_refused(tmp_path, file, old, new, why):
    folder = tmp_path / "as504"
    shutil.copytree(built_in_vehicles()["as504"], folder)
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))
    with pytest.raises(DataError, match=why):
        build_vehicle(folder, tmp_path / "out")


def test_axial_tables_without_an_outline_are_refused(tmp_path):
    folder = tmp_path / "as504"
    shutil.copytree(built_in_vehicles()["as504"], folder)
    toml = folder / "construction.toml"
    begin = toml.read_text().index("[outline]")
    toml.write_text(toml.read_text()[:begin] + toml.read_text()[toml.read_text().index("[atmosphere]") :])
    assert load_construction(folder).outline is None
    with pytest.raises(DataError, match=r"needs \[outline\] in construction\.toml"):
        build_vehicle(folder, tmp_path / "out")
