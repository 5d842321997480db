from . import errors as errors
from .model.system.define import define_system as define_system
from .model.system.linear_system import LinearSystem as LinearSystem
from .model.vehicle.reader import load_vehicle as load_vehicle
from .runners.construct.build_vehicle import build_vehicle as build_vehicle
from .runners.design.design import design as design
from .runners.parameter_study.run import run_parameter_study as run_parameter_study
from .runners.statistics.results import ResponseStatistics as ResponseStatistics
from .runners.study import Study as Study
from .runners.wind.synthesis.synthesise import synthesise as synthesise

__version__: str
