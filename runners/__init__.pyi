from .parameter_study import run_parameter_study as run_parameter_study
from .solvers.covariance import CovarianceOptions as CovarianceOptions
from .solvers.ensemble import EnsembleOptions as EnsembleOptions
from .solvers.integration import IntegratorOptions as IntegratorOptions
from .solvers.sweep import SweepOptions as SweepOptions
from .statistics.results import ResponseStatistics as ResponseStatistics
from .study import Study as Study
