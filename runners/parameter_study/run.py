"""A parameter study from plan to stored result: resumed where it stood, nothing computed twice."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...model.errors import DataError, OutputFolderError, ParameterValueError, UnknownNameError
from ...model.system.names import COMBINED
from ...model.vehicle.planes import PLANES
from ..case.provenance import provenance
from ..case.times import parse_times
from ..present.files import write_bytes
from ..present.netcdf import RULE, one_unit_a_variable, with_conventions
from ..present.notebook import html_of, shortened
from ..present.progress import steps
from ..statistics.dataset import QUANTITIES
from ..statistics.norm import LIKE_3_SIGMA
from ..statistics.resultants import MEANINGS, labels_of, response_or_resultant, resultant_pairs
from ..statistics.sweep import Sweep
from ..study import Study
from .cluster import compute_on_cluster
from .compute import FAILED, STATUS, Chunk, ChunkResult, Task, chunks, compute_chunk, engine_name
from .local import compute_locally
from .plan import ParameterStudyPlan, read_plan
from .quantities import Quantity, resolve_quantities
from .sampling import member_values
from .store import DIMENSIONS, ChunkStore, identity_of, netcdf_bytes, open_store

RESULT_FILE = "study.nc"
LARGEST = 2**31  # bytes of a variable in the file format

Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False, repr=False)
class ParameterStudy:
    """A parameter study that has been computed.

    Attributes
    ----------
    plan : ParameterStudyPlan
    study : Study
        With the nominal numbers.
    quantities : tuple of Quantity
        What was varied.
    data : xarray.Dataset
        ``value`` (member, quantity); ``status`` (member: 0 computed, 1 unstable, 2 failed) and ``reason``;
        ``mean`` (member, time, response) and ``std`` (member, time, response, source), NaN where a member failed;
        ``nominal_mean`` and ``nominal_std`` of the unchanged study. Of resultants of both planes ``plane_mean``
        (member, time, resultant, plane), ``plane_covariance`` (member, time, resultant, source, plane, other_plane)
        and ``level`` (member, time, resultant), which is passed with the probability in the attributes; each with its
        ``nominal_...``.
    """

    plan: ParameterStudyPlan
    study: Study
    quantities: tuple[Quantity, ...]
    data: xr.Dataset

    @property
    def computed(self) -> NDArray[np.bool_]:
        """Members that have numbers, (members,)."""
        return self.data["status"].values != FAILED

    @property
    def names(self) -> list[str]:
        """Names of the responses, then of the resultants."""
        resultants = self.data["resultant"].values if "resultant" in self.data else ()
        return [str(name) for name in (*self.data["response"].values, *resultants)]

    def __repr__(self) -> str:
        failed, times = int((~self.computed).sum()), self.data["time"].values
        lines = [
            f"ParameterStudy of {self.study.system.name}, {self.plan.kind.replace('_', ' ')}",
            f"members: {self.computed.size}" + (f", {failed} of them failed" if failed else ""),
            f"varied: {shortened([q.name for q in self.quantities])}",
            f"responses: {shortened(self.names)}",
            f"end times: {times.size}, {times[0]:g} to {times[-1]:g} s",
        ]
        return "\n  ".join(lines)

    def _repr_html_(self) -> str:
        return html_of(repr(self))


def run_parameter_study(
    plan: str | Path | Mapping[str, Any] | ParameterStudyPlan,
    folder: str | Path,
    *,
    study: Study | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> ParameterStudy:
    """Compute the members of a parameter study that a folder does not hold yet, and put all together.

    Parameters
    ----------
    plan : path, mapping or ParameterStudyPlan
        A TOML file, or the same as a mapping (docs/studies.md).
    folder : path
        For chunks of members as they come, and ``study.nc``. One that holds a part of the same study is continued.
    study : Study, optional
        Instead of the plan's ``vehicle``; a system of your own too.
    scheduler : str, optional
        Address of a Dask scheduler; all cores of this machine without it.
    progress : callable, optional
        Called with the number of members done and of all.

    Returns
    -------
    ParameterStudy

    Raises
    ------
    DataError, TimeRangeError, UnknownNameError
        The plan asks for what the vehicle does not have.
    ResumeError
        The folder holds another study.
    OutputFolderError
        It cannot be written; what is stored stays.
    SchedulerError
    """
    file = Path(plan) if isinstance(plan, str | Path) else None
    plan = read_plan(plan)
    if study is None:
        study = Study.load(plan.named_vehicle())
    try:
        quantities = resolve_quantities(study, plan)
        values = member_values(plan, quantities)
        task = replace(_task(study, plan, quantities), members=len(values))
        _check_size(study, task, len(values))
    except DataError as error:
        raise DataError(error.why, file=error.file or file, column=error.column) from None
    folder = Path(folder)
    with open_store(folder, identity_of(study, plan, task, values)) as store:
        found = _complete(store, study, task, list(chunks(values)), len(values), scheduler, progress)
        data = _dataset(study, plan, task, values, found)
        write_bytes(folder / RESULT_FILE, netcdf_bytes(stored_layout(data)))
    return ParameterStudy(plan, study, quantities, data)


def _task(study: Study, plan: ParameterStudyPlan, quantities: tuple[Quantity, ...]) -> Task:
    text = plan.times or (study.vehicle.file.default_times if study.vehicle else None)
    if text is None:
        raise DataError("is missing; a system of your own has no default times", column="times")
    times = sorted(set(parse_times(text)))
    study.checked_times(times)
    Sweep(plan.relative_tolerance)
    known = (*study.system.sources, COMBINED)
    for source in plan.sources or ():
        if source not in known:
            raise UnknownNameError("noise source", source, known)
    responses, resultants = _names(study, plan)
    if plan.probability is not None and not resultants:
        raise DataError(
            "is that of resultants of both planes, and none is asked for; leave it out", column="probability"
        )
    chance = LIKE_3_SIGMA if plan.probability is None else plan.probability
    return Task(quantities, tuple(times), responses, resultants, plan.relative_tolerance, chance)


def _names(study: Study, plan: ParameterStudyPlan) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return responses and resultants that a plan asks for; without names all that there are."""
    pairs, outputs = resultant_pairs(study.system.output_names), study.system.outputs
    if plan.responses is None:
        units = {output.name: output.unit for output in outputs}
        alike = (name for name, (first, second) in pairs.items() if units[first] == units[second])
        return tuple(study.checked_responses(None)), tuple(alike)
    asked = [response_or_resultant(study, name) for name in plan.responses]
    return tuple(n for n in asked if n not in pairs), tuple(n for n in asked if n in pairs)


def _check_size(study: Study, task: Task, members: int) -> None:
    over, sources = 8 * members * len(task.times), len(study.system.sources) + 1
    deviations, covariances = over * len(task.responses) * sources, 4 * over * sources * bool(task.resultants)
    if (size := max(deviations, covariances)) > LARGEST:
        raise DataError(
            f"{members} members at {len(task.times)} end times make {size / 1e9:.3g} GB of standard deviations or "
            "covariances, more than a result file holds; take fewer times, responses or members"
        )


def _complete(
    store: ChunkStore,
    study: Study,
    task: Task,
    wanted: list[Chunk],
    members: int,
    scheduler: str | None,
    progress: Progress | None,
) -> list[ChunkResult]:
    """Read what is stored, compute and store the rest."""
    found = {chunk.first: result for chunk in wanted if (result := store.read(chunk)) is not None}
    missing = [chunk for chunk in wanted if chunk.first not in found]
    done = sum(len(result.status) for result in found.values())
    if progress:
        progress(done, members)
    with steps("members") as line, closing(_results(study, task, missing, scheduler)) as results:
        line.reached(done, members)
        for chunk, result in results:
            try:
                store.write(chunk, result)
            except OutputFolderError as error:
                raise OutputFolderError(
                    f"{error}; {done} of {members} members are stored and stay: make room, then run the same again"
                ) from None
            found[chunk.first] = result
            done += len(result.status)
            line.reached(done)
            if progress:
                progress(done, members)
    return [found[chunk.first] for chunk in wanted]


def _results(
    study: Study, task: Task, missing: list[Chunk], scheduler: str | None
) -> Generator[tuple[Chunk, ChunkResult], None, None]:
    """Yield the chunks as they are done."""
    if missing and scheduler:
        yield from compute_on_cluster(scheduler, study, task, missing)
    elif missing:
        yield from compute_locally(study, task, missing)


def _dataset(
    study: Study, plan: ParameterStudyPlan, task: Task, values: NDArray[np.float64], found: list[ChunkResult]
) -> xr.Dataset:
    sources = [*(s for s in plan.sources or study.system.sources if s != COMBINED), COMBINED]
    mean = np.concatenate([r.mean for r in found])
    std = _std(study, sources, np.concatenate([r.variance for r in found]))
    nominal = _nominal(study, task)
    units = [study.system.outputs[study.system.output_index(r)].unit for r in task.responses]
    data = xr.Dataset(
        {
            "value": (("member", "quantity"), values, {RULE: "quantity", "long_name": "value in a member"}),
            "status": (
                "member",
                np.concatenate([r.status for r in found]),
                {"flag_values": [*range(len(STATUS))], "flag_meanings": " ".join(STATUS)},
            ),
            "reason": ("member", [text for r in found for text in r.reason]),
            "mean": (("member", "time", "response"), mean),
            "std": (("member", "time", "response", "source"), std),
            "nominal_mean": (("time", "response"), nominal.mean[0]),
            "nominal_std": (("time", "response", "source"), _std(study, sources, nominal.variance[0])),
        },
        {
            "time": ("time", list(task.times), {"units": "s", "long_name": "flight time t2"}),
            "response": list(task.responses),
            "unit": ("response", units),
            "source": sources,
            "quantity": [q.name for q in task.quantities],
            "quantity_unit": ("quantity", [q.unit for q in task.quantities]),
            "quantity_nominal": ("quantity", [q.nominal for q in task.quantities]),
        },
        provenance(study) | {"plan": plan.model_dump_json(exclude_none=True), "engine": engine_name(study)},
    )
    for name in ("mean", "std"):
        data[name].attrs |= {RULE: "response", "long_name": f"{QUANTITIES[name]} of a member"}
        data[f"nominal_{name}"].attrs |= {RULE: "response", "long_name": f"{QUANTITIES[name]}, nothing varied"}
    return _with_resultants(data, study, task, found, nominal) if task.resultants else data


def _with_resultants(
    data: xr.Dataset, study: Study, task: Task, found: list[ChunkResult], nominal: ChunkResult
) -> xr.Dataset:
    names = ("plane_mean", "plane_covariance", "level")
    members = {name: np.concatenate([getattr(r, name) for r in found]) for name in names}
    of_nominal = {name: getattr(nominal, name)[0] for name in names}
    sources = data["source"].values.tolist()
    for part in (members, of_nominal):
        part["plane_covariance"] = _by_source(study, sources, part["plane_covariance"], axis=-3)
    variables = {}
    for name in names:
        meaning, rule = MEANINGS[name]
        dims, attributes = ("time", *DIMENSIONS[name][1:]), {RULE: rule}
        variables[name] = (("member", *dims), members[name], attributes | {"long_name": f"{meaning}, of a member"})
        variables[f"nominal_{name}"] = dims, of_nominal[name], attributes | {"long_name": f"{meaning}, nothing varied"}
    coordinates = {
        "resultant": list(task.resultants),
        "resultant_unit": ("resultant", [labels_of(study, name)[0].unit for name in task.resultants]),
        "plane": list(PLANES),
        "other_plane": list(PLANES),
    }
    return data.assign(variables).assign_coords(coordinates).assign_attrs(probability=task.probability)


def stored_layout(data: xr.Dataset) -> xr.Dataset:
    """Return the data of a parameter study as study.nc holds them: one unit a variable (docs/results.md)."""
    nominal = data["quantity_nominal"].reset_coords(drop=True).assign_attrs({RULE: "quantity", "long_name": "nominal"})
    data = data.drop_vars("quantity_nominal").assign(nominal_value=nominal)
    units = {"response": data["unit"].values.tolist(), "quantity": data["quantity_unit"].values.tolist()}
    if "resultant" in data:
        units["resultant"] = data["resultant_unit"].values.tolist()
    return with_conventions(one_unit_a_variable(data, units))


def _std(study: Study, sources: list[str], variance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviations of chosen sources; all of them stand behind the combined one."""
    return np.sqrt(_by_source(study, sources, variance, axis=-1))


def _by_source(study: Study, sources: list[str], values: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Return what chosen sources have of values by source along an axis, or all together."""
    names = list(study.system.sources)
    columns = [values.sum(axis) if s == COMBINED else values.take(names.index(s), axis) for s in sources]
    return np.stack(columns, axis)


def _nominal(study: Study, task: Task) -> ChunkResult:
    """Return the statistics of the unchanged study, computed as a member is."""
    nominal = np.array([[q.nominal for q in task.quantities]])
    result = compute_chunk(study, task, Chunk(0, nominal))
    if result.status[0] == FAILED:
        raise ParameterValueError(f"the vehicle itself, nothing varied, fails: {result.reason[0]}")
    return result
