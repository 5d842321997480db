"""Parameter studies: grids, one parameter at a time, dispersions; stored as they come, on this machine or a cluster."""

from .changes import changes as changes
from .run import ParameterStudy as ParameterStudy
from .run import run_parameter_study as run_parameter_study
from .spread import spread as spread
