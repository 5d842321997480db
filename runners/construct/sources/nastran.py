"""From a mapping file, a deck and its results to the tables of a construction; every statement held against another."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ....model.construction.given_modes import GivenModes
from ....model.errors import DataError
from ..beam.elements import element_flexibilities
from .deck import Deck, read_deck
from .mapping import ResultEntry, read_mapping
from .results import ASK_FOR_SHAPES, read_results
from .structure_lines import Structure

Array = NDArray[np.float64]

LARGEST_PRODUCT = 0.05  # of two modes, or of a mode and a rigid motion, by the deck's masses
LARGEST_MASS_ERROR = 0.05  # of a generalised mass against the deck's masses
LARGEST_FREQUENCY_ERROR = 0.02  # against the energies of the shape
LEAST_SHARE = 0.99  # of a mode's motion, by mass, in the lateral direction
RIGID = 1e-3  # of the highest of the modes asked for


def read_nastran(file: Path) -> Structure:
    """Read what a mapping file names.

    Masses and stiffness are those of the mapping's own deck; modes at each time are held against the deck that they
    were computed with: orthogonality to each other and to rigid motion, generalised mass, and frequency by the
    energies of the shape.

    Parameters
    ----------
    file : Path
        A mapping file; docs/construction.md describes it.

    Raises
    ------
    DataError
        File and card of what cannot be used or does not go together.
    MissingLibraryError
    """
    mapping = read_mapping(file)
    deck = read_deck(file.parent / mapping.deck, mapping, mapping.mass_kg)
    times = [entry.time_s for entry in mapping.results]
    if (np.diff(times) <= 0).any():
        raise DataError("has times that do not increase; sort [[results]] by time_s", file=file, column="results")
    if len({len(entry.modes) for entry in mapping.results}) > 1:
        raise DataError("has unlike numbers of modes; give as many at each time", file=file, column="results")
    checks = [
        f"{mapping.deck}: {deck.lump.sum():.6g} kg, {len(deck.grid)} grids from {deck.station[0]:g} to "
        f"{deck.station[-1]:g} m"
    ]
    parts = []
    for entry in mapping.results:
        of_entry = deck if entry.deck is None else read_deck(file.parent / entry.deck, mapping, None)
        if not np.array_equal(of_entry.station, deck.station):
            raise DataError(f"has other grids on the centreline than {mapping.deck}", file=of_entry.file)
        parts.append(_modes(file.parent / entry.file, entry, of_entry, checks))
    modes = None
    if parts:
        stacked = [np.stack([part[k] for part in parts]) for k in range(4)]
        try:
            modes = GivenModes.scaled(np.array(times), deck.station, *stacked)
        except DataError as error:
            at = times.index(error.time) if error.time in times else 0
            raise DataError(error.why, file=file.parent / mapping.results[at].file, time=error.time) from None
    return Structure(deck.masses, deck.stiffness, modes, mapping.status, mapping.source, tuple(checks))


def _modes(file: Path, entry: ResultEntry, deck: Deck, checks: list[str]) -> tuple[Array, Array, Array, Array]:
    """Return frequencies, generalised masses, displacements (k, n) and rotations (k, n) of one file, in SI."""
    found = read_results(file)
    for mode in entry.modes:
        if mode not in found.shapes:
            known = ", ".join(str(m) for m in sorted(found.shapes)[:12])
            raise DataError(f"has no mode {mode}; its modes: {known}", file=file)
        missing = [grid for grid in deck.grid if grid not in found.shapes[mode]]
        if missing:
            raise DataError(f"mode {mode} has no displacement of GRID {missing[0]}; {ASK_FOR_SHAPES}", file=file)
    vectors = np.array([[found.shapes[mode][grid] for grid in deck.grid] for mode in entry.modes])
    frequency = np.array([found.frequency.get(mode, 0.0) for mode in entry.modes])
    _refuse_rigid(file, entry.modes, frequency)
    moved = vectors[..., :3] @ deck.axes.T
    displacement, rotation = moved[..., 1], vectors[..., 3:] @ deck.axes[2] / deck.metre
    share = (displacement**2 @ deck.lump) / ((moved**2).sum(axis=-1) @ deck.lump)
    if (share < LEAST_SHARE).any():
        k = int(np.argmax(share < LEAST_SHARE))
        raise DataError(
            f"mode {entry.modes[k]} has {share[k]:.2f} of its motion in the lateral direction; name lateral modes, and "
            "hold a deck with alike planes in the others by SPC",
            file=file,
        )
    gram = displacement * deck.lump @ displacement.T + rotation * deck.inertia @ rotation.T
    _check_products(file, entry.modes, deck, displacement, rotation, gram)
    own = np.diag(gram)
    mass = np.array([found.generalized_mass.get(mode, np.nan) for mode in entry.modes]) * deck.kilogram
    stated = np.isfinite(mass)
    error = np.where(stated, mass / own - 1, 0.0)
    if np.abs(error).max() > LARGEST_MASS_ERROR:
        k = int(np.argmax(np.abs(error)))
        raise DataError(
            f"mode {entry.modes[k]} has a generalised mass of {mass[k]:.6g} kg where its shape and {deck.file.name} "
            f"give {own[k]:.6g}; the files are of different decks, or in mixed units",
            file=file,
        )
    energies = np.sqrt(_strain(deck, displacement, rotation) / own)
    if (off := np.abs(energies / frequency - 1)).max() > LARGEST_FREQUENCY_ERROR:
        k = int(np.argmax(off))
        raise DataError(
            f"mode {entry.modes[k]} has {frequency[k]:.5g} rad/s where its shape and {deck.file.name} give "
            f"{energies[k]:.5g}; the files are of different decks, or in mixed units",
            file=file,
        )
    mass = np.where(stated, mass, own)
    for k, mode in enumerate(entry.modes):
        end = displacement[k, -1]
        checks.append(
            f"{file.name}, {entry.time_s:g} s, mode {mode}: {frequency[k] / (2 * np.pi):.5g} Hz, forward end at "
            f"{end:+.4g} in the file, now 1; generalised mass {mass[k] / end**2:.6g} kg"
            f"{'' if stated[k] else ' (by the deck, the file states none)'}, by the masses {own[k] / end**2:.6g} kg"
        )
    return frequency, mass, displacement, rotation


def _refuse_rigid(file: Path, modes: tuple[int, ...], frequency: Array) -> None:
    rigid = frequency <= RIGID * frequency.max()
    if rigid.any() or not np.isfinite(frequency).all():
        mode = modes[int(np.argmax(rigid))]
        raise DataError(f"mode {mode} is a rigid-body mode or has no eigenvalue; name elastic modes", file=file)


def _check_products(
    file: Path, modes: tuple[int, ...], deck: Deck, displacement: Array, rotation: Array, gram: Array
) -> None:
    """Hold modes against each other and against rigid motion, by the deck's masses."""
    size = np.sqrt(np.diag(gram))
    product = np.abs(gram) / np.outer(size, size) - np.eye(size.size)
    if product.max() > LARGEST_PRODUCT:
        i, j = np.unravel_index(int(np.argmax(product)), product.shape)
        raise DataError(
            f"modes {modes[min(i, j)]} and {modes[max(i, j)]} are not orthogonal by the masses of {deck.file.name} "
            f"({product.max():.3f}, {LARGEST_PRODUCT:g} allowed)",
            file=file,
        )
    arm = deck.station - deck.lump @ deck.station / deck.lump.sum()
    rigid = [
        np.abs(displacement @ deck.lump) / np.sqrt(deck.lump.sum()) / size,
        np.abs(displacement @ (deck.lump * arm) + rotation @ deck.inertia)
        / np.sqrt(deck.lump @ arm**2 + deck.inertia.sum())
        / size,
    ]
    for left, verb in zip(rigid, ("moves", "turns"), strict=True):
        if left.max() > LARGEST_PRODUCT:
            raise DataError(
                f"mode {modes[int(np.argmax(left))]} {verb} the masses of {deck.file.name} as a whole "
                f"({left.max():.3f} of its size, {LARGEST_PRODUCT:g} allowed); the deck is held, or masses are others",
                file=file,
            )


def _strain(deck: Deck, displacement: Array, rotation: Array) -> Array:
    """Return twice the strain energy of shapes (k,), by the elements between the grids (N m)."""
    step = np.diff(deck.station)
    relative = np.stack(
        [np.diff(displacement) - step * rotation[:, :-1], np.diff(rotation)], axis=-1
    )  # forward node against the aft one held
    flexibility = element_flexibilities(deck.beam, deck.station)
    force = np.linalg.solve(flexibility[None], relative[..., None])[..., 0]
    return (relative * force).sum(axis=(1, 2))
