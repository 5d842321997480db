"""The main job for a system of one's own on disk: tables and figures of all responses."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from ...model.errors import UnusedOptionError
from ..present.terminal import console, print_table
from .job import Job, on_terminal, steps
from .terminal import results_folder

if TYPE_CHECKING:
    from ..statistics.engine import Engine
    from ..statistics.results import ResponseStatistics

TIMES = 100  # where neither the file nor --times names any


def run_system(
    file: Path, times: str | None, out: Path | None, engine: Engine | None, chances: tuple[float, ...],
    unused: Mapping[str, object],
) -> Path:  # fmt: skip
    """Compute the statistics of a system that a TOML file describes.

    Parameters
    ----------
    file : Path
    times : str, optional
    out : Path, optional
    engine : Engine, optional
    chances : tuple of float
        Probabilities of levels at an instant.
    unused : mapping of option to value
        What only a vehicle knows, and is refused where it was typed.

    Returns
    -------
    Path
        The folder of the results.

    Raises
    ------
    UnusedOptionError, DataError, TimeRangeError, IntegrationError, OutputFolderError
    """
    from ...model.files.toml_file import read_toml
    from ...model.system.system_file import SystemFile, system_of
    from ..case.times import parse_times
    from ..present.style import write_figure
    from ..present.wording import words
    from ..statistics.larger_side import LABEL
    from ..study import Study

    for option, value in unused.items():
        if value:
            raise UnusedOptionError(f"{option} is of a vehicle and not used with --system; leave it out")
    said = read_toml(file, SystemFile)
    with steps("loading"):
        study = Study.from_system(system_of(said, file))
    asked = times or said.default_times
    start, end = study.system.start, study.system.end
    ends = parse_times(asked) if asked else [start + (end - start) * k / TIMES for k in range(1, TIMES + 1)]
    study.checked_times(ends)
    job = Job(out or results_folder(study.system.name, "results"))
    with on_terminal():
        statistics = study.response_statistics(ends, engine=engine)
    if chances:
        statistics = statistics.with_percentiles(chances)
    job.replace_earlier("run", study)
    job.written += statistics.save(job.folder)
    with steps("figures", len(study.system.outputs)) as bar:
        for output in study.system.outputs:
            title = f"{study.system.name}\n{words(output.name).capitalize()}, mean and {LABEL}"
            job.written += write_figure(statistics.plot(output.name, title), job.folder, output.name)
            bar.done()
    _print_peaks(statistics)
    job.end()
    return job.folder


def _print_peaks(statistics: ResponseStatistics) -> None:
    from ..present.wording import words
    from ..statistics.larger_side import LABEL

    table = Table("response", title=f"Peaks of {LABEL}")
    for column in ("time", LABEL, "mean", "σ", "unit"):
        table.add_column(column, justify="right", no_wrap=True)
    for peak in statistics.peaks():
        numbers = (f"{x:.4g}" for x in (peak.value, peak.mean, peak.std))
        table.add_row(words(peak.response), f"{peak.time:g} s", *numbers, peak.unit)
    print_table(table, console)
