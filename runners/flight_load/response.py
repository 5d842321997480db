"""One response of a case, or the resultant of two planes, over a window of flight as a process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...model.errors import ParameterValueError
from ..case.case import Case
from ..case.chain import TOLERANCE
from ..solvers.markov_chain import MarkovChain
from ..statistics.norm import NormOfNormal
from ..statistics.resultants import resultant_pairs
from .norms import Norms
from .process import JointOutputs, joint_covariance, joint_outputs
from .window import window_chain

HALVINGS = 2  # from the grid of which paths are drawn to the one on which they are seen
STEPS = 2400  # of the window at first; AS-504 in 60 s: 0.025 s
COARSE = 1.0  # s, between the times at which a resultant is seen where its window is worth drawing
FINE = 0.025  # s, at most between the points at which it is seen there, at first
LEFT_OUT = 2e-3  # of the probability, at most, that is passed only where no path is drawn


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
    """

    case: Case
    response: str
    window: tuple[float, float]
    steps: int

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
        return window_chain(self.case, self.window, self.steps, TOLERANCE)

    def near(self, probability: float) -> ResponseInWindow:
        """Return it over the part of the window in which the level passed with a probability is passed at all.

        Of one response all of the window; both planes have twice the states and are looked at where it matters.
        """
        if not self.is_resultant:
            return self
        begin, end = self.window
        chain = window_chain(self.case, self.window, max(2, int(np.ceil((end - begin) / COARSE))))
        C = chain.output[:, self.rows]
        law = NormOfNormal(chain.mean[:, self.rows], C @ chain.covariance() @ C.swapaxes(1, 2))
        if not float(law.covariance.max()) > 0:
            return self
        beyond = law.exceedance(law.percentile(probability).max())  # flights pass a higher level
        kept = np.flatnonzero(beyond >= LEFT_OUT * beyond.max() / beyond.size)
        first, last = max(int(kept[0]) - 1, 0), min(int(kept[-1]) + 1, beyond.size - 1)
        part = float(chain.times[first]), float(chain.times[last])
        spacing = min(end - begin, FINE * STEPS) / self.steps
        steps = 4 * int(np.ceil((part[1] - part[0]) / spacing / 4))
        return replace(self, window=part, steps=min(max(steps, 8), self.steps))


def squared_diffusion(
    chain: MarkovChain, row: NDArray[np.float64], sources: Sequence[int] | None = None
) -> NDArray[np.float64]:
    """Return C B B' C' of outputs by their rows (m, r, n), (m, r, r)."""
    direct = row @ chain.acting_noise_matrix(sources)
    return direct @ direct.swapaxes(1, 2)
