"""``ascentwind reproduce``: our numbers beside the report's, as a page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .job import Job, load_study, steps

STEPS = 45  # about as many as there are options, winds and evaluations of a calibration


def reproduce(
    out: Annotated[Path, typer.Option(help="Folder of the page and its figure.")] = Path("docs"),
) -> None:
    """AS-504 against every figure that NASA CR-103010 published: prediction, options, winds, flight, calibration."""
    from ...model.construction.construction_file import load_construction
    from ...model.vehicle.shipped import find_vehicle
    from ..present.files import prepare_folder, write_text
    from ..present.style import write_figure
    from ..reproduction.as506.flight import trajectory_checks
    from ..reproduction.as506.loads import load_checks
    from ..reproduction.as506.mass import mass_checks
    from ..reproduction.calibration import calibrate
    from ..reproduction.mean_wind import mean_wind
    from ..reproduction.options import effects
    from ..reproduction.page import Reproduction, page
    from ..reproduction.predictions import predict
    from ..reproduction.winds import compare, wind_figure

    job = Job(out)
    prepare_folder(out / "figures")
    vehicle = "as504"
    study = load_study(vehicle)
    construction = load_construction(find_vehicle(vehicle))
    with steps("options", STEPS) as bar:
        step = bar.done
        found = effects(vehicle, lambda name: step(f"option {name}"))
        local = next(e.responses for e in found if e.option and e.option.name == "local_angle_of_attack")
        assert local is not None
        winds = compare(study, lambda: step("winds"))
        predictions = predict(study, local, winds.sensitivity)
        checks = (*trajectory_checks(construction), *mass_checks(construction), *load_checks(construction))
        step("flight of AS-506")
        calibration = calibrate(vehicle, lambda text: step(f"calibration, {text}"))
        scaled = mean_wind(vehicle)
        step("mean wind")
    text = page(Reproduction(predictions, found, winds, checks, calibration, scaled))
    title = "Bending moment of AS-504 at station 25 m under different winds"
    job.written += write_figure(wind_figure(winds, title), out / "figures", "reproduction_winds")
    job.written.append(write_text(out / "reproduction.md", text))
    job.end()
