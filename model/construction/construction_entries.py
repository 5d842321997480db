"""What construction.toml may hold."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from ..files.folder_files import FileName
from ..files.toml_file import Name, NotNegative, Positive, Section, Whole

Status = Literal["found", "computed", "assumed", "memory"]


class FileEntry(Section):
    """A CSV file; every row of it has its status and source."""

    file: FileName


class TankSectionEntry(Section):
    kind: Literal["cylinder", "cone", "ellipsoid"]
    begin_m: float
    end_m: float
    radius_m: Positive
    end_radius_m: NotNegative | None = None
    center_m: float | None = None
    semi_axis_m: Positive | None = None
    sign: Literal[1, -1] = 1
    count: Annotated[Whole, Field(ge=1)] = 1

    @model_validator(mode="after")
    def _keys_of_kind(self):
        if (self.kind == "cone") != (self.end_radius_m is not None):
            raise ValueError('end_radius_m belongs to kind = "cone", and only to it')
        for key in ("center_m", "semi_axis_m"):
            if (self.kind == "ellipsoid") != (getattr(self, key) is not None):
                raise ValueError(f'{key} belongs to kind = "ellipsoid", and only to it')
        return self


class TankEntry(Section):
    name: Name
    density_kg_m3: Positive
    liquid_kg: NotNegative
    sloshes: bool
    sections: Annotated[tuple[TankSectionEntry, ...], Field(min_length=1)]
    status: Status
    source: str


class EngineEntry(Section):
    name: Name
    count: Annotated[Whole, Field(ge=1)]
    gimballed: bool
    exit_area_m2: NotNegative
    file: FileName
    draws: dict[str, Positive]
    cutoff_s: float | None = None
    cutoff_event: Name
    residual_kg: dict[str, NotNegative] = Field(default_factory=dict)
    status: Status
    source: str


class GrainEntry(Section):
    begin_m: float
    end_m: float
    radius_m: Positive
    density_kg_m3: Positive
    distance_m: NotNegative = 0.0


class SolidMotorEntry(Section):
    """Motors that burn alike; propellant and ``file`` are of one of them."""

    name: Name
    count: Annotated[Whole, Field(ge=1)]
    gimballed: bool
    exit_area_m2: NotNegative
    file: FileName
    grain: GrainEntry
    propellant_kg: Positive
    sliver_kg: NotNegative = 0.0
    burnout_event: Name
    status: Status
    source: str


class JettisonEntry(Section):
    event: Name
    time_s: float
    masses: tuple[str, ...] = ()
    motors: tuple[str, ...] = ()
    normal_force: tuple[str, ...] = ()
    drag_file: FileName | None = None
    status: Status
    source: str


class NormalForceEntry(Section):
    """A part of the normal force; its slope over Mach number is the column of its name in ``file``."""

    name: Name
    file: FileName
    station_m: Annotated[tuple[float, ...], Field(min_length=2)]
    shape: Annotated[tuple[NotNegative, ...], Field(min_length=2)]
    status: Status
    source: str

    @model_validator(mode="after")
    def _equal_lengths(self):
        if len(self.station_m) != len(self.shape):
            raise ValueError(f"has {len(self.station_m)} stations and {len(self.shape)} values of shape; give as many")
        return self


class PitchEntry(Section):
    kind: Literal["polynomials", "table", "gravity_turn"]
    file: FileName
    time_base_s: float = 0.0
    begin_s: float
    arrest_s: float | None = None

    @model_validator(mode="after")
    def _arrest(self):
        if (self.kind == "gravity_turn") == (self.arrest_s is not None):
            raise ValueError('arrest_s is needed by kind = "polynomials" and "table" and not used by "gravity_turn"')
        return self


class SiteEntry(Section):
    latitude_deg: Annotated[float, Field(ge=-90, le=90)]
    azimuth_deg: float
    altitude_m: float
    platform_release_s: float
    release_s: float
    status: Status
    source: str


class ConstructionFile(Section):
    """The whole construction.toml; stations are metres in the vehicle's own count, forward positive."""

    format: Literal[1]
    name: Name
    gimbal_station_m: float
    sensor_station_m: float
    aft_end_m: float
    forward_end_m: float
    reference_area_m2: Positive
    bending_modes: Annotated[Whole, Field(ge=0)]
    slosh_method: Literal["surface_radius", "cylinder", "potential"]
    load_stations_m: tuple[float, ...] = ()
    end_time_s: Positive
    status: Status
    source: str
    masses: FileEntry
    stiffness: FileEntry
    modes: FileEntry | None = None
    drag: FileEntry
    outline: FileEntry | None = None
    atmosphere: FileEntry | None = None
    pitch: PitchEntry
    site: SiteEntry
    tanks: tuple[TankEntry, ...] = ()
    engines: tuple[EngineEntry, ...] = ()
    solid_motors: tuple[SolidMotorEntry, ...] = ()
    jettisons: tuple[JettisonEntry, ...] = ()
    normal_force: Annotated[tuple[NormalForceEntry, ...], Field(min_length=1)]
