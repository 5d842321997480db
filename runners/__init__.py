"""Response statistics, checks, figures and the command line."""

from .integration import IntegratorOptions as IntegratorOptions
from .statistics import ResponseStatistics as ResponseStatistics
from .study import Study as Study
