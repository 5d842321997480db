"""A NASTRAN stick model: grids on the centreline, CONM2 on them, CBAR and CBEAM from one to the next."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....model.construction.structure import LumpedMass, Stiffness
from ....model.errors import DataError, DataErrorCollector
from .mapping import MappingFile
from .pynastran import pynastran, reading
from .structure_lines import StiffnessRow

Array = NDArray[np.float64]

LENGTH_ERROR = 1e-3  # of the line's length against the mapping's ends
MASS_ERROR = 0.01  # of the deck's mass against the mapping's
SHIFT = 5e-3  # of the length, of the centre of gravity when masses are spread
RIGID_IN_SHEAR = 1e6  # times E I over the length squared, where a bar has no shear flexibility
ALONG = 1e-3  # of a direction, across
YOUNG = (1e8, 2e12)  # Pa
DENSITY = (5.0, 3e4)  # kg/m3
PIECES = 8  # of an element whose mass varies along it


@dataclass(frozen=True, eq=False)
class Deck:
    """A stick model in SI, aft to forward.

    Attributes
    ----------
    file : Path
    grid : tuple of int
        Numbers of the grids.
    station : (n,) array
        m, in the vehicle's own count.
    lump, inertia : (n,) arrays
        Mass at the grids, half of each element's at its ends (kg), and mass moment of inertia about the lateral axis
        (kg m2).
    masses : tuple of LumpedMass
        Each spread from halfway to the grid before to halfway to the next, elements along themselves.
    stiffness : tuple of StiffnessRow
    axes : (3, 3) array
        Rows: forward, lateral, and the axis about which a section turns when the displacement grows forward.
    metre, kilogram : float
        SI units in one of the deck's.
    """

    file: Path
    grid: tuple[int, ...]
    station: Array
    lump: Array
    inertia: Array
    masses: tuple[LumpedMass, ...]
    stiffness: tuple[StiffnessRow, ...]
    axes: Array
    metre: float
    kilogram: float

    @property
    def beam(self) -> Stiffness:
        """The stiffness line as the beam takes it."""
        rows = self.stiffness
        return Stiffness(*(np.array([getattr(r, name) for r in rows]) for name in ("station", "bending", "shear")))


def read_deck(file: Path, mapping: MappingFile, expected_mass: float | None) -> Deck:
    """Read a deck.

    Parameters
    ----------
    file : Path
    mapping : MappingFile
    expected_mass : float or None
        kg, as somebody knows it.

    Raises
    ------
    DataError
        File and card of what cannot be used.
    MissingLibraryError
    """
    model = _bdf(file)
    axes = np.array([_direction(mapping.forward), _direction(mapping.lateral), np.zeros(3)])
    axes[2] = np.cross(axes[0], axes[1])
    grids, station = _line(file, model, mapping, axes)
    place = {grid: i for i, grid in enumerate(grids)}
    collector = DataErrorCollector()
    lump, inertia, masses, rows = np.zeros(len(grids)), np.zeros(len(grids)), [], []
    factor = _weight_factor(file, model) * mapping.kilogram
    for number, card in sorted(model.masses.items()):
        with collector.part():
            i, mass, turning, offset = _lumped(file, number, card, place, axes, factor, mapping)
            lump[i], inertia[i] = lump[i] + mass, inertia[i] + turning
            low = 0.5 * (station[max(i - 1, 0)] + station[i]) + offset
            high = 0.5 * (station[i] + station[min(i + 1, station.size - 1)]) + offset
            low, high = max(low, float(station[0])), min(high, float(station[-1]))
            masses.append(LumpedMass(f"CONM2 {number}", low, high, mass, float(np.sqrt(2 * turning / mass))))
    between: dict[int, list[tuple[str, Array, Array]]] = {}
    for number, card in sorted(model.elements.items()):
        if card.type == "PLOTEL":
            continue
        with collector.part():
            i, bending, shear, line_mass = _element(file, number, card, place, axes, mapping, station)
            between.setdefault(i, []).append((f"{card.type} {number}", bending, shear))
            length = float(station[i + 1] - station[i])
            pieces = _pieces(f"{card.type} {number}", station[i], length, line_mass * factor / mapping.metre)
            masses += pieces
            for piece in pieces:
                lump[i : i + 2] += 0.5 * piece.mass
    for number, card in sorted(model.rigid_elements.items()):
        tied = {*getattr(card, "independent_nodes", ()), *getattr(card, "dependent_nodes", ())} & place.keys()
        if len(tied) > 1:
            why = f"{card.type} {number} ties grids of the centreline together; give them a stiff CBAR instead"
            collector.errors.append(DataError(why, file=file))
    collector.raise_all()
    for i in range(len(grids) - 1):
        parts = between.get(i)
        if parts is None:
            why = f"no CBAR or CBEAM joins GRID {grids[i]} to GRID {grids[i + 1]}, its neighbour on the centreline"
            raise DataError(f"{why}; add it, or take the grids off 'grids'", file=file)
        item = ", ".join(name for name, _, _ in parts)
        bending = np.sum([own for _, own, _ in parts], axis=0)
        shear = np.sum([own for _, _, own in parts], axis=0)
        for end in (0, 1):
            rows.append(StiffnessRow(item, float(station[i + end]), float(bending[end]), float(shear[end])))
    _check_mass(file, lump, masses, station, expected_mass, mapping)
    deck = (file, tuple(grids), station, lump, inertia, tuple(masses), tuple(rows), axes)
    return Deck(*deck, mapping.metre, mapping.kilogram)


def _bdf(file: Path) -> Any:
    made = pynastran("bdf.bdf", "BDF")
    with reading(file):
        text = file.read_text(encoding="latin-1")
        model = made(debug=None)
        model.read_bdf(str(file), xref=True, punch="BEGIN BULK" not in text.upper())
    return model


def _direction(name: str) -> Array:
    return (-1.0 if name.startswith("-") else 1.0) * np.eye(3)["xyz".index(name[-1])]


def _line(file: Path, model: Any, mapping: MappingFile, axes: Array) -> tuple[list[int], Array]:
    """Return the grids of the centreline and their stations, aft to forward."""
    numbers = [n for n in sorted(model.nodes) if mapping.holds(n)]
    missing = [g for g in mapping.grids if isinstance(g, int) and g not in model.nodes]
    if missing or len(numbers) < 4:
        why = f"has no GRID {missing[0]}" if missing else f"has {len(numbers)} of the grids of the centreline; four do"
        raise DataError(f"{why}; correct 'grids' of the mapping", file=file)
    with reading(file):
        places = np.array([model.nodes[n].get_position() for n in numbers]) @ axes.T * mapping.metre
    order = np.argsort(places[:, 0], kind="stable")
    places, grids = places[order], [numbers[i] for i in order]
    collector = DataErrorCollector()
    middle = np.median(places[:, 1:], axis=0)
    for number, place in zip(grids, places, strict=True):
        off = float(np.hypot(*(place[1:] - middle)))
        if off > mapping.off_centreline_m:
            why = f"GRID {number} lies {off:.4g} m off the centreline of the others; correct it, or take it off 'grids'"
            collector.errors.append(DataError(why, file=file))
        if model.nodes[number].Cd() != 0:
            why = f"GRID {number} moves in coordinate system {model.nodes[number].Cd()}; leave its CD field empty"
            collector.errors.append(DataError(why, file=file))
    along = places[:, 0] - places[0, 0]
    if (twin := np.flatnonzero(np.diff(along) <= 1e-9 * along[-1])).size:
        why = f"GRID {grids[twin[0]]} and GRID {grids[twin[0] + 1]} lie at one station; take one off 'grids'"
        collector.errors.append(DataError(why, file=file))
    collector.raise_all()
    length = mapping.forward_end_m - mapping.aft_end_m
    if abs(along[-1] - length) > LENGTH_ERROR * length:
        raise DataError(
            f"GRID {grids[0]} to GRID {grids[-1]} reach over {along[-1] / mapping.metre:.6g} {mapping.length}, "
            f"{along[-1]:.6g} m, but aft_end_m and forward_end_m of the mapping over {length:.6g} m; correct "
            "'length', 'grids' or the ends",
            file=file,
        )
    return grids, mapping.aft_end_m + along * (length / along[-1])


def _weight_factor(file: Path, model: Any) -> float:
    if "WTMASS" not in model.params:
        return 1.0
    with reading(file):
        return float(model.params["WTMASS"].values[0])


def _lumped(
    file: Path, number: int, card: Any, place: dict[int, int], axes: Array, factor: float, mapping: MappingFile
) -> tuple[int, float, float, float]:
    """Return index of the grid, mass (kg), inertia (kg m2) and offset forward (m) of a mass card."""
    name = f"{card.type} {number}"
    if card.type != "CONM2":
        raise DataError(f"{name} is a kind of mass that is not read; write it as CONM2", file=file)
    if card.Nid() not in place:
        raise DataError(f"{name} stands on GRID {card.Nid()}, which is not one of the centreline's 'grids'", file=file)
    if card.Cid() != 0:
        raise DataError(f"{name} counts in coordinate system {card.Cid()}; write it in the basic one", file=file)
    offset = axes @ np.asarray(card.X, dtype=float) * mapping.metre
    if np.hypot(*offset[1:]) > mapping.off_centreline_m:
        raise DataError(f"{name} lies {np.hypot(*offset[1:]):.4g} m off the centreline; put it on the axis", file=file)
    mass = card.mass * factor
    if not mass > 0:
        raise DataError(f"{name} has a mass of {card.mass:g}; give a positive one", file=file)
    xx, yx, yy, zx, zy, zz = (float(v) for v in card.I)
    tensor = np.array([[xx, -yx, -zx], [-yx, yy, -zy], [-zx, -zy, zz]])
    turning = float(axes[2] @ tensor @ axes[2]) * factor * mapping.metre**2
    if turning < 0:
        raise DataError(f"{name} has a negative moment of inertia; correct it", file=file)
    return place[card.Nid()], mass, turning, float(offset[0])


def _element(
    file: Path, number: int, card: Any, place: dict[int, int], axes: Array, mapping: MappingFile, station: Array
) -> tuple[int, Array, Array, Array]:
    """Return the aft grid's index, bending and shear stiffness at both ends, and mass per length, of an element."""
    name = f"{card.type} {number}"
    if card.type not in ("CBAR", "CBEAM"):
        raise DataError(f"{name} is no beam; condense the model to a stick of CBAR and CBEAM", file=file)
    ends = [place.get(n) for n in (card.Ga(), card.Gb())]
    if None in ends or abs(ends[0] - ends[1]) != 1:  # type: ignore[operator]
        raise DataError(
            f"{name} joins GRID {card.Ga()} to GRID {card.Gb()}, which are no neighbours on the centreline", file=file
        )
    if np.abs([card.wa, card.wb]).max() > 0 or any(str(pin) not in ("0", "") for pin in (card.pa, card.pb)):
        raise DataError(f"{name} has offsets or pins; write it without", file=file)
    kind, material = card.pid_ref, card.pid_ref.mid_ref
    prop = f"{kind.type} {kind.pid} of {name}"
    if kind.type not in ("PBAR", "PBARL", "PBEAM"):
        raise DataError(f"{prop} is not read; write it as PBAR, PBARL or PBEAM", file=file)
    if material.type != "MAT1":
        raise DataError(f"{material.type} {material.mid} of {name} is not read; write it as MAT1", file=file)
    _check_material(file, material, mapping)
    if kind.type == "PBEAM":
        columns = [np.asarray(v, dtype=float)[[0, -1]] for v in (kind.A, kind.i1, kind.i2, kind.i12, kind.nsm)]
    else:
        values = (kind.Area(), kind.I11(), kind.I22(), kind.I12(), kind.Nsm())
        columns = [np.full(2, float(v)) for v in values]
    area, first, second, product, other = columns
    in_first = _in_first_plane(file, name, card, axes, bool((first == second).all() and not product.any()))
    if product.any():
        raise DataError(f"{prop} has a product of inertia; turn its axes to the principal ones", file=file)
    share = getattr(kind, "k1" if in_first else "k2", None)
    bending = material.E() * (first if in_first else second)
    if not (bending > 0).all():
        raise DataError(f"{prop} has no bending stiffness in the lateral plane; give its moment of inertia", file=file)
    bending = bending * mapping.kilogram * mapping.metre**3
    length = float(station[-1] - station[0])
    shear = RIGID_IN_SHEAR * bending / length**2
    if share and material.G():
        shear = float(share) * area * material.G() * mapping.kilogram * mapping.metre
    line_mass = area * material.Rho() + other
    first_end = 0 if ends[0] < ends[1] else 1  # type: ignore[operator]
    order = [first_end, 1 - first_end]
    return min(ends), bending[order], shear[order], line_mass[order]  # type: ignore[type-var]


def _in_first_plane(file: Path, name: str, card: Any, axes: Array, round_section: bool) -> bool:
    """Tell whether an element bends in its plane 1 when it bends laterally."""
    if round_section:
        return True
    if card.g0 is not None:
        vector = card.g0_ref.get_position() - card.ga_ref.get_position()
    else:
        vector = np.asarray(card.x, dtype=float)
    across = axes[1:] @ vector
    across = np.abs(across / np.hypot(*across))
    if min(across) > ALONG:
        raise DataError(f"{name} has its planes askew to the lateral direction; turn its orientation vector", file=file)
    return bool(across[0] > across[1])


def _check_material(file: Path, material: Any, mapping: MappingFile) -> None:
    """Refuse a material with density that no solid has in the units of the mapping."""
    density = material.Rho() * mapping.kilogram / mapping.metre**3
    if density == 0:  # a material for stiffness alone may be anything
        return
    young = material.E() * mapping.kilogram / mapping.metre
    for value, (low, high), what, unit in ((young, YOUNG, "E", "Pa"), (density, DENSITY, "density", "kg/m3")):
        if not low <= value <= high:
            raise DataError(
                f"MAT1 {material.mid} has a {what} of {value:.3g} {unit} with length in {mapping.length} and mass in "
                f"{mapping.mass}, which no solid has; the deck mixes units, or the mapping names others",
                file=file,
            )


def _pieces(name: str, begin: float, length: float, per_metre: Array) -> list[LumpedMass]:
    """Return an element's mass spread along it; ``per_metre`` (kg/m) stands at both ends."""
    if not per_metre.any():
        return []
    count = 1 if per_metre[0] == per_metre[1] else PIECES
    edges = begin + length * np.linspace(0.0, 1.0, count + 1)
    middle = np.interp(0.5 * (edges[:-1] + edges[1:]), [begin, begin + length], per_metre)
    names = [name] if count == 1 else [f"{name} part {i + 1}" for i in range(count)]
    return [
        LumpedMass(n, float(a), float(b), float(m * length / count))
        for n, a, b, m in zip(names, edges[:-1], edges[1:], middle, strict=True)
    ]


def _check_mass(
    file: Path, lump: Array, masses: list[LumpedMass], station: Array, expected: float | None, mapping: MappingFile
) -> None:
    total = float(lump.sum())
    if expected is not None and abs(total - expected) > MASS_ERROR * expected:
        raise DataError(
            f"has {total:.6g} kg with mass in {mapping.mass}, but mass_kg of the mapping is {expected:.6g}; the deck "
            "mixes units or lacks PARAM WTMASS, or the mapping names another unit",
            file=file,
        )
    there = float(sum(m.mass * 0.5 * (m.begin + m.end) for m in masses)) / total
    shift = there - float(lump @ station) / total
    if abs(shift) > SHIFT * (station[-1] - station[0]):
        raise DataError(
            f"has masses so far apart that spreading them moves the centre of gravity by {shift:.3g} m; give more "
            "grids",
            file=file,
        )
