"""The mean response by the linear model and by the nonlinear planar equations, side by side."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib import rc_context

from ...model.vehicle.planes import require_yaw
from ..case.case import Case
from ..case.provenance import provenance
from ..present.progress import steps
from ..present.style import STYLE, Figure
from ..present.wording import words
from ..solvers.planar_mean import RESPONSES, planar_mean

MODELS = ("linear", "linear_rigid", "nonlinear_rigid")
_LABELS = {
    "linear": "linear, with bending and slosh",
    "linear_rigid": "linear, rigid",
    "nonlinear_rigid": "nonlinear, rigid",
}
_COLORS = {"linear": "#444444", "linear_rigid": "#1f6fb4", "nonlinear_rigid": "#c8442c"}


@steps("flight through the mean wind")
def mean_comparison(study: Case) -> xr.Dataset:
    """Return the mean angle of attack, engine angle and attitude over flight time by three models.

    Returns
    -------
    xarray.Dataset
        ``mean`` (model, time, response) in rad: 'linear' is the whole model with bending and slosh, 'linear_rigid' and
        'nonlinear_rigid' the rigid, controlled vehicle by the planar equations and their linearisation.

    Raises
    ------
    UnknownNameError
        If the study has no vehicle.
    DataError
        If the mean flight is unstable.
    """
    vehicle = study.vehicle_for("the mean flight")
    require_yaw(vehicle, "the nonlinear mean flight")
    planar = planar_mean(vehicle, study.executable)
    group = next(g for g in study.linear_means.groups if g.kind == "mean")
    columns = [group.names.index(f"mean.{name}") for name in RESPONSES]
    whole = group.evaluate(planar.times)[:, columns]
    return xr.Dataset(
        {
            "mean": (
                ("model", "time", "response"),
                np.stack([whole, planar.linear, planar.nonlinear]),
                {"units": "rad", "long_name": "mean response to the mean wind"},
            )
        },
        {
            "model": list(MODELS),
            "time": ("time", planar.times, {"units": "s", "long_name": "flight time"}),
            "response": list(RESPONSES),
        },
        provenance(study),
    )


def mean_comparison_figure(comparison: xr.Dataset, title: str) -> Figure:
    """Draw the responses (left) and what separates the models (right), in degrees."""
    mean = comparison["mean"] * (180 / np.pi)
    time = comparison["time"]
    rigid, nonlinear = (mean.sel(model=m) for m in ("linear_rigid", "nonlinear_rigid"))
    differences = {
        "nonlinearity (nonlinear less linear, rigid)": (nonlinear - rigid, _COLORS["nonlinear_rigid"]),
        "bending and slosh (whole model less rigid, linear)": (
            mean.sel(model="linear") - rigid,
            _COLORS["linear_rigid"],
        ),
    }
    with rc_context(STYLE):
        figure = Figure(figsize=(11.0, 8.0), layout="constrained")
        panels = figure.subplots(len(RESPONSES), 2, sharex=True)
        for response, (left, right) in zip(RESPONSES, panels, strict=True):
            for model, style, width in zip(MODELS, ("-", "-", "--"), (3.0, 1.6, 1.6), strict=True):
                values = mean.sel(model=model, response=response)
                left.plot(time, values, style, color=_COLORS[model], lw=width, label=_LABELS[model])
            for label, (difference, color) in differences.items():
                right.plot(time, difference.sel(response=response), color=color, lw=1.4, label=label)
            left.set_ylabel(f"{words(response)} (deg)")
            right.set_ylabel("difference (deg)")
        for axes, side in zip(panels[0], ("left", "right"), strict=True):
            place: Any = f"outside lower {side}"  # matplotlib's stubs do not know places outside
            figure.legend(*axes.get_legend_handles_labels(), loc=place)
        for axes in panels[-1]:
            axes.set_xlabel("flight time (s)")
        figure.suptitle(title)
    return figure
