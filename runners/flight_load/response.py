"""One response of a case, or the resultant of two planes, over a window of flight as a process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from ...model.errors import ParameterValueError
from ..case.case import Case
from ..case.chain import TOLERANCE
from ..solvers.markov_chain import MarkovChain
from ..statistics.norm import NormOfNormal
from ..statistics.percentiles import Sides, instant_level
from ..statistics.resultants import resultant_pairs
from .norms import Norms
from .process import JointOutputs, joint_covariance, joint_outputs
from .window import MOST_STEPS, PARTS, PartOfWindow, window_chain

HALVINGS = 2  # from the grid of which paths are drawn to the one on which they are seen
STEPS = 2400  # of the window at first; AS-504 in 60 s: 0.025 s
FINE = 0.025  # s, at most between the points at which a part is seen, at first
SCOUTED = 600  # steps of the window between the times at which it is judged where a level is passed
WIDEST = 2  # most steps of a part, as many times those of the window
ROUNDING = 1e-9
LEFT_OUT = 5e-5  # of the chance of the worst instant, at most, that all instants where no path is drawn have together


@dataclass(frozen=True, eq=False)
class ResponseInWindow:
    """A response or a resultant over a window.

    Attributes
    ----------
    case : Case
    response : str
        An output of the system, or the name of a resultant of two.
    window : (float, float)
        s.
    steps : int
        Of the window, on the grid on which paths are seen; a multiple of four.
    part : PartOfWindow or None
        Of a longer window, that it is.
    """

    case: Case
    response: str
    window: tuple[float, float]
    steps: int
    part: PartOfWindow | None = None

    @property
    def outputs(self) -> tuple[str, ...]:
        """The response, or both of which it is the norm."""
        return resultant_pairs(self.case.system.output_names).get(self.response, (self.response,))

    @property
    def is_resultant(self) -> bool:
        """Whether it is the norm of two outputs."""
        return len(self.outputs) == 2

    @property
    def unit(self) -> str:
        """Unit of the response.

        Raises
        ------
        ParameterValueError
            The outputs of a resultant have different ones.
        """
        units = [self.case.system.outputs[row].unit for row in self.rows]
        if units[0] != units[-1]:
            names = self.outputs
            raise ParameterValueError(
                f"'{names[0]}' is in {units[0]} and '{names[1]}' in {units[1]}: they have no norm"
            )
        return units[0]

    def process(self, sources: Sequence[int] | None = None) -> JointOutputs | Norms:
        """Return it as a process on both grids, from some sources by number or from all."""
        chain = self.chain
        parts = chain, chain.output[:, self.rows], chain.mean[:, self.rows], HALVINGS, sources
        return Norms.joint(*parts) if self.is_resultant else joint_outputs(*parts)

    def moments(self, relative_tolerance: float) -> tuple[NDArray[np.float64], ...]:
        """Return mean (m, r), covariance (m, r, m, r) and squared diffusion (m, r, r) on the grid drawn."""
        chain = window_chain(self.case, self.window, self.steps // 2**HALVINGS, relative_tolerance)
        row = chain.output[:, self.rows]
        return chain.mean[:, self.rows], joint_covariance(chain, row), squared_diffusion(chain, row)

    def share_of(self, sources: Sequence[int]) -> tuple[NDArray[np.float64], ...]:
        """Return covariance and squared diffusion on the grid drawn, as :meth:`moments`, from some sources alone."""
        chain, stride = self.chain, 2**HALVINGS
        row = chain.output[:, self.rows]
        return joint_covariance(chain, row, sources, stride), squared_diffusion(chain, row, sources)[::stride]

    def with_parameters(self, changes: Mapping[str, float]) -> ResponseInWindow:
        """Return the same of a case with other parameter values."""
        return replace(self, case=self.case.with_parameters(changes))

    @property
    def rows(self) -> list[int]:
        """Numbers of the response, or of both, among the outputs."""
        return [self.case.system.output_index(name) for name in self.outputs]

    @property
    def chain(self) -> MarkovChain:
        """The states at the times at which paths are seen."""
        if self.part is not None:
            return self.part.chain(self.case)
        return window_chain(self.case, self.window, self.steps, TOLERANCE)

    def near(self, probability: float, sides: Sides, sources: Sequence[int] | None = None) -> ResponseInWindow:
        """Return it over the part of the window in which the level passed with a probability is passed at all.

        Parameters
        ----------
        probability : float
            Of passing the level in flight; instants outside the part pass it too rarely to matter.
        sides : {'both', 'upper', 'lower'}
        sources : sequence of int, optional
            Numbers of those that act; all without it.
        """
        begin, end = self.window
        chain = window_chain(self.case, self.window, SCOUTED)
        C = chain.output[:, self.rows]
        mean, covariance = chain.mean[:, self.rows], C @ chain.covariance(sources) @ C.swapaxes(1, 2)
        if not float(covariance.max()) > 0:
            return self
        beyond = self._beyond(mean, covariance, probability, sides)
        rare = 0.5 * LEFT_OUT * float(beyond.max())
        first, last = np.searchsorted(np.cumsum(beyond), rare), np.searchsorted(np.cumsum(beyond[::-1]), rare)
        scouted = SCOUTED // PARTS
        first, last = max(int(first) - 1, 0) // scouted, PARTS - max(int(last) - 1, 0) // scouted
        spacing = min(end - begin, FINE * STEPS) / self.steps
        each = 4 * int(np.ceil((end - begin) / PARTS / spacing / 4 - ROUNDING))
        part = PartOfWindow(self.window, first, last, each)
        steps = (last - first) * each
        most = min(WIDEST * self.steps, MOST_STEPS)
        if steps > most:  # a long part of a long window makes a chain of its own, with longer steps
            return replace(self, window=part.span, steps=most)
        return replace(self, window=part.span, steps=steps, part=part)

    def _beyond(
        self, mean: NDArray[np.float64], covariance: NDArray[np.float64], probability: float, sides: Sides
    ) -> NDArray[np.float64]:
        """Return the chance of each instant (m,) to be beyond the level that the worst one passes with a probability.

        Flights pass a higher level with it.
        """
        if self.is_resultant:
            law = NormOfNormal(mean, covariance)
            return law.exceedance(law.percentile(probability).max())
        std = np.sqrt(np.maximum(covariance[:, 0, 0], 0.0))
        level = instant_level(mean[:, 0], std, probability, sides).max()
        signed = {"both": (1.0, -1.0), "upper": (1.0,), "lower": (-1.0,)}[sides]
        away = np.array([sign * mean[:, 0] - level for sign in signed])
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(std > 0, ndtr(away / std), away >= 0).sum(axis=0)


def squared_diffusion(
    chain: MarkovChain, row: NDArray[np.float64], sources: Sequence[int] | None = None
) -> NDArray[np.float64]:
    """Return C B B' C' of outputs by their rows (m, r, n), (m, r, r)."""
    direct = row @ chain.acting_noise_matrix(sources)
    return direct @ direct.swapaxes(1, 2)
