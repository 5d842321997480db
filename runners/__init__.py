"""Response statistics, checks, figures and the command line."""

from .covariance import CovarianceOptions as CovarianceOptions
from .ensemble import EnsembleOptions as EnsembleOptions
from .integration import IntegratorOptions as IntegratorOptions
from .parameter_study import run_parameter_study as run_parameter_study
from .statistics import ResponseStatistics as ResponseStatistics
from .study import Study as Study
from .sweep_engine import SweepOptions as SweepOptions
