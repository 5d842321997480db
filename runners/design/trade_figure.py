"""The trade of a design: the lowest peak against the limit on another one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib import rc_context

from ..present.style import SHADES, STYLE, Figure, wrapped
from ..present.wording import display, words
from ..statistics.resultants import labels_of, outputs_of
from .design import TradePoint


def trade_figure(trades: Mapping[str, Sequence[TradePoint]], response: str, title: str) -> Figure:
    """Return lowest peak over limit, one line a variant, which ends where a limit cannot be met; the start is marked.

    Parameters
    ----------
    trades : mapping of str to sequence of TradePoint
        By variant; one design at least was found.
    response : str
        Whose peak is limited.
    """
    first = next(p.result for points in trades.values() for p in points if p.result)
    before = {q.name: q.before for q in first.quantities}
    (up, up_unit), (along, along_unit) = (
        display(labels_of(first.problem.study, name)[0].unit, before[f"peak {name}"])
        for name in (first.problem.response, response)
    )
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        for (variant, points), color in zip(trades.items(), SHADES * len(trades), strict=False):
            met = [p for p in points if p.result]
            if met:
                heights = [up * p.result.peak for p in met if p.result]
                axes.plot([along * p.limit for p in met], heights, "o-", color=color, lw=2, ms=5, label=variant)
        axes.plot(
            along * before[f"peak {response}"], up * before[f"peak {first.problem.response}"],
            "*", color="black", ms=13, ls="none", label="before the design",
        )  # fmt: skip
        below, beside = (
            f"{'level of' if len(outputs_of(first.problem.study, name)) == 2 else '|mean| + 3σ'} {words(name)}"
            for name in (response, first.problem.response)
        )
        axes.set_xlabel(f"limit on the peak of {below} ({along_unit})")
        axes.set_ylabel(f"lowest peak of {beside} ({up_unit})")
        axes.legend()
        axes.set_title(wrapped(title))
    return figure
