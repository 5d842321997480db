"""One response of a case over a window of flight, as the process that its largest value is of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ..case.case import Case
from ..case.chain import TOLERANCE
from ..solvers.markov_chain import MarkovChain
from .process import OneOutput, one_output
from .window import window_chain

HALVINGS = 2  # from the grid of which paths are drawn to the one on which they are seen


@dataclass(frozen=True, eq=False)
class ResponseInWindow:
    """A response over a window.

    Attributes
    ----------
    case : Case
    response : str
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
    def unit(self) -> str:
        """Unit of the response."""
        return self.case.system.outputs[self.case.system.output_index(self.response)].unit

    def process(self, sources: Sequence[int] | None = None) -> OneOutput:
        """Return the response as a process on both grids, from some sources by number or from all."""
        return self._process(self.steps, HALVINGS, TOLERANCE, sources)

    def drawn_process(self, relative_tolerance: float) -> OneOutput:
        """Return the response on the grid of which paths are drawn alone."""
        return self._process(self.steps // 2**HALVINGS, 0, relative_tolerance, None)

    def with_parameters(self, changes: Mapping[str, float]) -> ResponseInWindow:
        """Return the same of a case with other parameter values."""
        return replace(self, case=self.case.with_parameters(changes))

    @property
    def number(self) -> int:
        """Number of the response among the outputs."""
        return self.case.system.output_index(self.response)

    @property
    def chain(self) -> MarkovChain:
        """The states at the times at which paths are seen."""
        return window_chain(self.case, self.window, self.steps, TOLERANCE)

    def _process(self, steps: int, halvings: int, tolerance: float, sources: Sequence[int] | None) -> OneOutput:
        chain, row = window_chain(self.case, self.window, steps, tolerance), self.number
        return one_output(chain, chain.output[:, row], chain.mean[:, row], halvings, sources)
