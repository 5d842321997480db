"""Wind response statistics of ascending launch vehicles by the method of adjoint systems; every public name is here.

Names are imported when first used, so that ``import ascentwind`` and a help text wait for nothing. ``__init__.pyi``
lists them for editors and type checkers; it is not read here, because parsing it would double the time of the import.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach(
    __name__,
    submodules={"errors"},
    submod_attrs={
        "model.system.define": ["define_system"],
        "model.system.linear_system": ["LinearSystem"],
        "model.system.system_file": ["read_system"],
        "model.vehicle.reader": ["load_vehicle"],
        "model.wind.soundings.read": ["read_profiles", "read_soundings"],
        "runners.construct.build_vehicle": ["build_vehicle"],
        "runners.design.design": ["design"],
        "runners.figures.plot": ["plot"],
        "runners.flight_load.limit_table": ["Limits"],
        "runners.flight_load.load": ["FlightLoad"],
        "runners.gusts.shapes": ["OneMinusCosine", "QuasiSquare", "RampAndHold"],
        "runners.measured_winds.persistence": ["ComponentPersistence", "Persistence"],
        "runners.parameter_study.run": ["run_parameter_study"],
        "runners.present.progress": ["show_progress"],
        "runners.statistics.covariance": ["CovarianceEquation"],
        "runners.statistics.cvodes": ["Cvodes"],
        "runners.statistics.ensemble": ["Ensemble"],
        "runners.statistics.norm": ["NormOfNormal"],
        "runners.statistics.results": ["ResponseStatistics"],
        "runners.statistics.sweep": ["Sweep"],
        "runners.study": ["Study"],
        "runners.wind.synthesis.synthesise": ["synthesise"],
        "version": ["__version__"],
    },
)
