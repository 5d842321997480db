"""What the vehicle and the wind are: symbols and data, nothing integrated and no C written."""

from .assemble import assemble as assemble
from .errors import AscentwindError as AscentwindError
from .errors import AscentwindWarning as AscentwindWarning
from .system import LinearSystem as LinearSystem
from .system import Noise as Noise
from .system import Output as Output
from .system import Parameter as Parameter
from .system import State as State
from .system import define_system as define_system
from .tables import Table as Table
from .tables import TableGroup as TableGroup
from .vehicle import Vehicle as Vehicle
from .vehicle import load_vehicle as load_vehicle
from .wind_filter import ShapingFilter as ShapingFilter
from .wind_filter import TwoPartKernel as TwoPartKernel
