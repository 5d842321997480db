"""Response statistics, checks, figures and the command line.

What it offers is loaded when asked for, so that the command can see to Ctrl-C before it loads anything slow.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .covariance import CovarianceOptions as CovarianceOptions
    from .ensemble import EnsembleOptions as EnsembleOptions
    from .integration import IntegratorOptions as IntegratorOptions
    from .parameter_study import run_parameter_study as run_parameter_study
    from .statistics import ResponseStatistics as ResponseStatistics
    from .study import Study as Study
    from .sweep_engine import SweepOptions as SweepOptions

_MODULES = {
    "CovarianceOptions": "covariance",
    "EnsembleOptions": "ensemble",
    "IntegratorOptions": "integration",
    "ResponseStatistics": "statistics",
    "Study": "study",
    "SweepOptions": "sweep_engine",
    "run_parameter_study": "parameter_study",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f".{_MODULES[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_MODULES})
