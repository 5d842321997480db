"""What a vehicle's TOML file may hold (pydantic)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from ..errors import DataErrorCollector
from ..files.folder_files import FileName
from ..files.toml_file import Name, NotNegative, Positive, Section, Whole, read_toml
from ..wind.turbulence import HIGH_PASS, LENGTH

ExtraOutput = Literal["lateral_drift", "drift_rate", "dynamic_pressure_times_angle_of_attack", "load_components"]
STRUCTURE = "structure"  # marks keys that change the equations, not numbers in them
NoiseLoads = Literal["moved_line", "couple_forward", "couple_aft", "as_reported"]
Planes = Literal["yaw", "pitch", "both"]


def _with_spread(value: Any) -> Any:
    if isinstance(value, int | float) and value == 0:
        raise ValueError("leaves the bias without spread, which is no bias; remove its section or give its sigma")
    return value


Spread = Annotated[float, BeforeValidator(_with_spread), Field(gt=0)]  # one sigma of a bias


class TableEntry(Section):
    """One CSV file: where it is, how it is interpolated, and where its numbers come from."""

    file: FileName
    status: Literal["found", "computed", "assumed"]
    source: str
    interpolation: Literal["cubic", "pchip", "linear", "step"] = "cubic"
    events: tuple[str, ...] = ()


class TransferFunctionEntry(Section):
    """Numerator and denominator in descending powers of s, as the report prints them."""

    numerator: Annotated[tuple[float, ...], STRUCTURE]
    denominator: Annotated[tuple[float, ...], STRUCTURE]
    source: str = ""

    @model_validator(mode="after")
    def _proper(self):
        if not self.numerator or not self.denominator or self.denominator[0] == 0:
            raise ValueError("needs a numerator and a denominator whose first coefficient is not zero")
        if len(self.numerator) > len(self.denominator):
            raise ValueError("has a numerator of higher order than its denominator; add the missing poles")
        return self


class SensorFeedbackEntry(Section):
    """Feedback of a load-relief sensor into the engine command.

    ``modes`` holds displacement and slope of the bending modes at the sensor, ``schedule`` factors on the gain.
    """

    position_m: float
    gain: float
    filter: TransferFunctionEntry
    modes: TableEntry | None = None
    schedule: TableEntry | None = None
    source: str = ""

    @model_validator(mode="after")
    def _strictly_proper(self):
        if len(self.filter.numerator) >= len(self.filter.denominator):
            raise ValueError(
                "has a filter with as many zeros as poles: wind and engine angle would return to the engine command "
                "without delay; add a pole, the sensor's bandwidth"
            )
        return self


class ControlEntry(Section):
    """Control law 4-4; ``accelerometer`` and ``angle_of_attack`` are load relief, absent in the report."""

    T1: TransferFunctionEntry
    T2: TransferFunctionEntry
    T3: TransferFunctionEntry
    gains: TableEntry
    accelerometer: SensorFeedbackEntry | None = None
    angle_of_attack: SensorFeedbackEntry | None = None

    @property
    def load_relief(self) -> dict[str, SensorFeedbackEntry]:
        """Feedback of load-relief sensors by name; empty without any."""
        entries = {"accelerometer": self.accelerometer, "angle_of_attack": self.angle_of_attack}
        return {sensor: entry for sensor, entry in entries.items() if entry is not None}


class BendingEntry(Section):
    damping: NotNegative
    table: TableEntry


class SloshEntry(Section):
    name: Annotated[Name, STRUCTURE]
    damping: NotNegative
    table: TableEntry


class LoadEntry(Section):
    """A bending moment, and by ``shear`` and ``axial`` the shear force and axial force at its station.

    ``forward_of_gimbal_m`` is ``station_m`` from the gimbal plane; all but the moment without slosh_reaction needs it.
    With ``radius_m``, of the vehicle there, the axial force and the moment make an equivalent axial load.
    """

    output: Annotated[Name, STRUCTURE]
    station_m: float
    forward_of_gimbal_m: float | None = None
    table: TableEntry
    local: TableEntry | None = None
    shear: Annotated[TableEntry | None, STRUCTURE] = None
    axial: Annotated[TableEntry | None, STRUCTURE] = None
    radius_m: Annotated[Positive | None, STRUCTURE] = None

    @model_validator(mode="after")
    def _placed(self):
        if (self.shear or self.axial) and self.forward_of_gimbal_m is None:
            raise ValueError("has a table of shear or axial force, which need forward_of_gimbal_m; add it")
        if self.radius_m is not None and self.axial is None:
            raise ValueError("has radius_m, which is used with a table of the axial force; add axial or remove it")
        return self


class NoiseEntry(Section):
    """A relative deviation of the named tables, coloured unless ``white`` is set.

    In both planes it is one deviation, ``common``, or one of its own in ``each``.
    """

    tables: Annotated[tuple[str, ...], STRUCTURE]
    sigma: NotNegative
    correlation_time_s: Positive = 1.0
    white: Annotated[bool, STRUCTURE] = False
    planes: Annotated[Literal["common", "each"], STRUCTURE] = "common"
    source: str = ""


class RelativeBiasEntry(Section):
    """A relative error that is constant over a flight, in both planes the same, ``common``, or one of ``each``."""

    standard_deviation: Spread
    planes: Annotated[Literal["common", "each"], STRUCTURE] = "common"
    source: str = ""


class LengthBiasEntry(Section):
    """A length that is constant over a flight."""

    standard_deviation_m: Spread
    source: str = ""


class AngleBiasEntry(Section):
    """An angle that is constant over a flight."""

    standard_deviation_deg: Spread
    source: str = ""


class BiasesEntry(Section):
    """What is constant over a flight and random from flight to flight; see model/vehicle/biases.py."""

    thrust: RelativeBiasEntry | None = None
    center_of_pressure: RelativeBiasEntry | None = None
    center_of_gravity_offset: LengthBiasEntry | None = None
    thrust_misalignment: AngleBiasEntry | None = None
    wind: RelativeBiasEntry | None = None


class Profile(Section):
    """Knots over altitude."""

    altitude_m: tuple[float, ...]
    value: tuple[float, ...]

    @model_validator(mode="after")
    def _ordered(self):
        if len(self.altitude_m) != len(self.value) or len(self.value) < 2:
            raise ValueError("needs as many values as altitudes, two at least")
        if any(b <= a for a, b in zip(self.altitude_m[:-1], self.altitude_m[1:], strict=True)):
            raise ValueError("needs altitudes that increase")
        if any(v <= 0 for v in self.value):
            raise ValueError("needs positive values")
        return self


class CorrelationEntry(Section):
    """Two-part kernel: a Matern-3/2 part of length ``long_scale_m`` and an exponential part of ``short_scale_m``."""

    long_scale_m: Profile
    short_scale_m: Profile
    short_fraction: Profile
    source: str

    @model_validator(mode="after")
    def _fraction(self):
        if any(v >= 1 for v in self.short_fraction.value):
            raise ValueError("needs short_fraction between 0 and 1")
        return self


class WindRecordEntry(Section):
    """Of which wind statistics and filter are; written by 'ascentwind wind apply'."""

    site: str
    component: Literal["zonal", "meridional"]
    period: str
    edition: str
    azimuth_deg: Annotated[float, Field(ge=-360, le=360)]
    sign: Literal[1, -1]
    held_above_m: float
    source: str
    independent_samples: Annotated[float, Field(gt=1)] | None = None


class TurbulenceEntry(Section):
    """Turbulence beside the wind of the statistics, as intense as ``severity`` of MIL-F-8785C or a table of one's own.

    ``severity = "off"`` leaves it out and keeps the rest for another day.
    """

    severity: Annotated[Literal["off", "light", "moderate", "severe"] | None, STRUCTURE] = None
    intensity: TableEntry | None = None
    form: Annotated[Literal["dryden", "von-karman-2", "von-karman-3"], STRUCTURE] = "dryden"
    length_m: Positive = LENGTH
    high_pass_m: Annotated[Positive | Literal["none"], STRUCTURE] = HIGH_PASS
    correlation: Annotated[Annotated[float, Field(gt=-1, lt=1)] | None, STRUCTURE] = None

    @model_validator(mode="after")
    def _one_intensity(self):
        if self.severity is None and self.intensity is None:
            raise ValueError(
                'needs severity = "light", "moderate" or "severe", or a table as [wind.turbulence.intensity]'
            )
        if self.severity not in (None, "off") and self.intensity is not None:
            raise ValueError("has a severity and a table of its own intensity; keep one")
        return self


class ComponentsRecordEntry(Section):
    """Of which statistics the two components are; written by 'ascentwind wind apply --components both'."""

    site: str
    period: str
    edition: str
    held_above_m: float
    source: str
    independent_samples: Annotated[float, Field(gt=1)] | None = None


class ComponentsEntry(Section):
    """Zonal and meridional wind together, of a vehicle that flies in both planes."""

    statistics: TableEntry
    filter: FileName
    record: ComponentsRecordEntry | None = None


class WindEntry(Section):
    """``synthesis`` chooses between ``filter``, a file of 'ascentwind wind fit', and [wind.correlation].

    In both planes it is ``components``, turned by ``azimuth_deg``, from north towards east, and with ``azimuth_change``
    by the trajectory's column of that name.
    """

    azimuth_deg: Annotated[float, Field(ge=0, le=360)] | None = None
    azimuth_change: Annotated[bool, STRUCTURE] = False
    air_speed: Annotated[Literal["no_wind", "mean_wind"], STRUCTURE] = "no_wind"
    pitch_wind: Annotated[Literal["normal", "horizontal"], STRUCTURE] = "normal"
    components: ComponentsEntry | None = None
    synthesis: Annotated[Literal["fitted", "closed_form"] | None, STRUCTURE] = None
    statistics: TableEntry
    standard_deviation: Literal["table", "cr103010_fit"] = "table"
    filter: FileName | None = None
    correlation: CorrelationEntry | None = None
    record: WindRecordEntry | None = None
    turbulence: TurbulenceEntry | None = None

    @model_validator(mode="after")
    def _one_filter(self):
        if self.filter is None and self.correlation is None:
            raise ValueError('needs filter = "FILE" (ascentwind wind fit) or [wind.correlation] (closed form)')
        if self.synthesis is None and self.filter is not None and self.correlation is not None:
            raise ValueError(
                'has both a filter and [wind.correlation]; choose with synthesis = "fitted" or "closed_form"'
            )
        if self.fitted and self.filter is None:
            raise ValueError('has synthesis = "fitted" but no filter = "FILE"; write one with \'ascentwind wind fit\'')
        if not self.fitted and self.correlation is None:
            raise ValueError('has synthesis = "closed_form" but no [wind.correlation]; add it or take "fitted"')
        if self.fitted and self.standard_deviation != "table":
            raise ValueError(
                f'has standard_deviation = "{self.standard_deviation}", which only the closed form takes: a fitted '
                'filter holds its own; set synthesis = "closed_form" or remove it'
            )
        return self

    @property
    def fitted(self) -> bool:
        """Whether the filter file is used, not the closed form."""
        return self.synthesis == "fitted" or (self.synthesis is None and self.filter is not None)


class OptionsEntry(Section):
    full_coupling: bool = False
    local_angle_of_attack: bool = False
    slosh_reaction: bool = False
    p_delta: bool = False
    noise_loads: NoiseLoads = "moved_line"
    mean_response: Literal["linear", "nonlinear"] = "linear"
    trajectory_angle_of_attack: bool = False
    wind_biased_programme: bool = False
    extra_outputs: tuple[ExtraOutput, ...] = ()
    gust_zones: Annotated[Whole, Field(ge=1)] | None = None


class TablesEntry(Section):
    rigid_body: TableEntry
    trajectory: TableEntry
    propulsion: TableEntry
    aerodynamics: TableEntry
    product_of_inertia: TableEntry | None = None
    local_aerodynamics: TableEntry | None = None
    loads_along_vehicle: TableEntry | None = None
    shear_along_vehicle: TableEntry | None = None
    axial_along_vehicle: TableEntry | None = None
    normal_force_along_vehicle: TableEntry | None = None


class PlaneTablesEntry(Section):
    """Tables of one plane, in the place of the vehicle's; of the moment of inertia the column alone."""

    moment_of_inertia: TableEntry | None = None
    aerodynamics: TableEntry | None = None
    local_aerodynamics: TableEntry | None = None
    loads_along_vehicle: TableEntry | None = None
    shear_along_vehicle: TableEntry | None = None


class PlaneEntry(Section):
    """What differs in one plane; each takes the place of the vehicle's own section whole."""

    tables: PlaneTablesEntry = PlaneTablesEntry()
    control: Annotated[ControlEntry | None, STRUCTURE] = None
    bending: Annotated[tuple[BendingEntry, ...] | None, STRUCTURE] = None
    slosh: Annotated[tuple[SloshEntry, ...] | None, STRUCTURE] = None
    loads: Annotated[tuple[LoadEntry, ...] | None, STRUCTURE] = None


class VehicleFile(Section):
    """The whole TOML file."""

    format: Literal[1]
    name: Name
    title: str
    start_time_s: float
    default_times: str
    weighting_times_s: tuple[float, ...] = ()
    planes: Annotated[Planes, STRUCTURE] = "yaw"
    roll_deg: Annotated[float | None, Field(ge=-360, le=360), STRUCTURE] = None
    pitch: PlaneEntry | None = None
    yaw: PlaneEntry | None = None
    reference_area_m2: Positive
    reference_area_source: str = ""
    events: Annotated[dict[str, float], STRUCTURE] = Field(default_factory=dict)
    tables: TablesEntry
    control: ControlEntry
    bending: Annotated[tuple[BendingEntry, ...], STRUCTURE] = ()
    slosh: Annotated[tuple[SloshEntry, ...], STRUCTURE] = ()
    loads: Annotated[tuple[LoadEntry, ...], STRUCTURE] = ()
    noise: Annotated[dict[Name, NoiseEntry], STRUCTURE] = Field(default_factory=dict)
    biases: Annotated[BiasesEntry, STRUCTURE] = BiasesEntry()
    wind: WindEntry
    options: Annotated[OptionsEntry, STRUCTURE] = OptionsEntry()


def read_vehicle_file(
    file: Path, changes: Mapping[str, Any] | None = None, collector: DataErrorCollector | None = None
) -> VehicleFile:
    """Read and check a vehicle's TOML file.

    Parameters
    ----------
    file : Path
    changes : mapping, optional
        Values to put in the place of the file's, by dotted key: ``{"options.full_coupling": True}``. Items of a list
        count from 0 (``bending.0.damping``).
    collector : DataErrorCollector, optional
        As of :func:`read_toml`.

    Raises
    ------
    DataError
        The file, the key in it, what is wrong and the nearest valid key.
    """
    return read_toml(file, VehicleFile, changes, collector)
