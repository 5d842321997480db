"""The figure of a result, whatever it is: what the commands draw, for a notebook or a script."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...model.errors import ParameterValueError, UnknownNameError, UnusedOptionError
from ..design.design import DesignResult
from ..design.peak_figure import design_figure
from ..design_wind.design_wind import DesignWind
from ..design_wind.figure import design_wind_figure
from ..flight_load.capability_figure import capability_figure
from ..flight_load.exceedance_figure import exceedance_figure
from ..flight_load.limits_figure import limits_figure
from ..flight_load.load import FlightLoad
from ..flight_load.passage import Passage
from ..gusts.figures import gust_figure
from ..gusts.search import GustSweep
from ..measured_winds.availability_figure import availability_figure
from ..measured_winds.day_of_launch import DayOfLaunch
from ..measured_winds.flown_figure import flown_figure
from ..measured_winds.flown_resultants import FlownResultants
from ..measured_winds.fly import FlownWinds
from ..measured_winds.launch_page import launch_figure
from ..parameter_study.changes import changes
from ..parameter_study.dispersion_figures import histogram_figure, tornado_figure
from ..parameter_study.grid_figure import grid_figure
from ..parameter_study.measures import measures
from ..parameter_study.run import ParameterStudy
from ..parameter_study.spread import spread
from ..present.style import Figure
from ..present.wording import words
from ..sensitivity.derivative_figures import tornado_figure as elasticity_figure
from ..statistics.response_figures import weighting_figure
from ..statistics.resultant_figures import history_figure
from ..statistics.resultants import Resultants
from ..statistics.results import ResponseStatistics
from ..views.resultants_along_vehicle import resultants_along_figure
from ..wind.filter_figures import covariance_figure
from ..wind.synthesis.result import SynthesisResult

OF_ONE_RESPONSE = (FlightLoad, DayOfLaunch, SynthesisResult, DesignResult, DesignWind, Passage)
PLOTTED = (*OF_ONE_RESPONSE, ResponseStatistics, Resultants, GustSweep, FlownWinds, FlownResultants, ParameterStudy)
DATASETS = "sensitivities, weighting functions, resultants along the vehicle and availability"


def plot(result: Any, response: str | None = None, title: str | None = None) -> Figure:
    """Return the figure of a result, which shows itself in a notebook.

    Parameters
    ----------
    result : ResponseStatistics, Resultants, FlightLoad, GustSweep, FlownWinds, DayOfLaunch, ParameterStudy or so
        The load of a flight: chances of passing each level, and when. Limits together: what each may be and what it
        reaches. A day of launch, with limits: the wind and the responses with their bands. A synthesis: covariances of
        filter and data. A study: a histogram, the changes one by one, or a grid of up to two quantities. A design:
        what was designed and limited, before and after. A design wind: its profile. Of datasets those of sensitivities,
        weighting functions, resultants along the vehicle and availability.
    response : str, optional
        Which one, where the result has several; its first without it.
    title : str, optional

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ParameterValueError
        Of a result that has no such figure.
    UnknownNameError
        With the nearest response.
    UnusedOptionError
        A response for a result of one response or of none.
    LimitError
        A day of launch without limits.
    """
    if isinstance(result, xr.Dataset):
        return _of_dataset(result, response, title)
    if not isinstance(result, PLOTTED):
        raise ParameterValueError(f"a {type(result).__name__} has no figure; plot takes {_listed()}")
    if isinstance(result, OF_ONE_RESPONSE):
        if response is not None:
            raise UnusedOptionError(f"response is not used for a {type(result).__name__}; leave it out")
        return _of_one(result, title)
    name = _chosen(response, _responses(result))
    if isinstance(result, ResponseStatistics):
        return result.plot(name, title)
    if isinstance(result, Resultants):
        return history_figure(result, name, title or words(name).capitalize())
    if isinstance(result, GustSweep):
        return gust_figure([result], [result.over_time(name)], name, title or "Gusts")
    if isinstance(result, ParameterStudy):
        return _of_study(result, name)
    return flown_figure(result, name, title or "Flown winds")


def _listed() -> str:
    return f"{', '.join(sorted(each.__name__ for each in PLOTTED))}, and datasets of {DATASETS}"


def _of_one(result: Any, title: str | None) -> Figure:
    if isinstance(result, FlightLoad):
        return exceedance_figure(result, title or f"Largest {words(result.response)} of the flight")
    if isinstance(result, DayOfLaunch):
        return launch_figure(result, title or "The day of launch")
    if isinstance(result, DesignResult):
        return design_figure(result, title or "A design")
    if isinstance(result, DesignWind):
        return design_wind_figure(result, title or "A design wind")
    if isinstance(result, Passage):
        over_stations = not np.isnan([load.station for load in result.loads]).any()
        draw = capability_figure if over_stations else limits_figure
        return draw(result, title or "Limits together")
    return covariance_figure(result.statistics, result.covariance, title or result.statistics.name)


def _of_dataset(result: xr.Dataset, response: str | None, title: str | None) -> Figure:
    if "input_weighting" in result and "time" not in result.dims:
        names = [str(name) for name in result["response"].values]
        name = _chosen(response, names)
        unit = str(result["input_weighting"]["unit"].sel(response=name).values)
        return weighting_figure([result], name, unit, title or f"Weighting function from wind to {words(name)}")
    if response is not None:
        raise UnusedOptionError("response is not used for such a dataset; leave it out")
    if {"elasticity", "parameter"} <= {*result.variables}:
        return elasticity_figure(result)
    if {"plane_covariance", "level"} <= {*result.variables}:
        largest = result["level"].max("station")
        time = float(result["time"][int(largest.values.argmax())])
        return resultants_along_figure(
            result, time, title or f"{words(result.attrs['load'])} of both planes".capitalize()
        )
    if {"month", "azimuth"} <= {*result.dims} and "probability" in result:
        return availability_figure(result, title or "Share of flights that pass a limit")
    raise ParameterValueError(
        f"this dataset, of {', '.join(map(str, result.data_vars))}, has no figure; plot takes those of {DATASETS}, and "
        "xarray plots a variable: dataset.NAME.plot()"
    )


def _of_study(result: ParameterStudy, name: str) -> Figure:
    if result.plan.kind == "dispersion":
        return histogram_figure(result, measures(result), spread(result), name)
    if result.plan.kind == "one_at_a_time":
        return tornado_figure(result, changes(result), name)
    if len(result.quantities) > 2:
        raise ParameterValueError(f"a grid of {len(result.quantities)} quantities has no figure; use its data")
    return grid_figure(result, measures(result), name)


def _responses(result: Any) -> Sequence[str]:
    if isinstance(result, ResponseStatistics):
        return [str(name) for name in result.dataset["response"].values]
    if isinstance(result, Resultants):
        return [str(name) for name in result.dataset["resultant"].values]
    if isinstance(result, ParameterStudy):
        return [str(name) for name in measures(result)["response"].values]
    return result.responses


def _chosen(response: str | None, known: Sequence[str]) -> str:
    if response is None:
        return known[0]
    if response not in known:
        raise UnknownNameError("response", response, known)
    return response
