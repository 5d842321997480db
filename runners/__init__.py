"""Response statistics, checks, figures and the command line."""

import lazy_loader as _lazy

_find, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
_SUCCESSORS = {
    "SweepOptions": "Sweep",
    "IntegratorOptions": "Cvodes",
    "CovarianceOptions": "CovarianceEquation",
    "EnsembleOptions": "Ensemble",
}


def __getattr__(name: str) -> object:
    if name not in _SUCCESSORS:
        return _find(name)
    from ..model.deprecation import warn_deprecated

    warn_deprecated(f"ascentwind.runners.{name}", f"ascentwind.{_SUCCESSORS[name]}")
    return _find(_SUCCESSORS[name])
