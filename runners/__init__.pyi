from .parameter_study import run_parameter_study as run_parameter_study
from .statistics.covariance import CovarianceEquation as CovarianceEquation
from .statistics.cvodes import Cvodes as Cvodes
from .statistics.ensemble import Ensemble as Ensemble
from .statistics.results import ResponseStatistics as ResponseStatistics
from .statistics.sweep import Sweep as Sweep
from .study import Study as Study

CovarianceOptions = CovarianceEquation
EnsembleOptions = Ensemble
IntegratorOptions = Cvodes
SweepOptions = Sweep
