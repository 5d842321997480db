"""Draws the figures of the method in docs/figures, after the report's 2-4 to 2-6: the system, its adjoint, the sources.

python tools/draw_method.py
"""

from __future__ import annotations

import sys
from pathlib import Path

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

from ascentwind.runners.present.style import COLORS, STYLE, Figure

FIGURES = Path(__file__).parents[1] / "docs" / "figures"
WIND, VEHICLE, SUM = "#dbe8f4", "#f6ded7", "#e7e7e7"
INK = "#222222"


def box(axes: Axes, x: float, y: float, text: str, color: str, width: float = 2.6, height: float = 1.3) -> None:
    """Draw a block about a point."""
    corner, rounded = (x - width / 2, y - height / 2), "round,pad=0,rounding_size=0.12"
    axes.add_patch(FancyBboxPatch(corner, width, height, boxstyle=rounded, facecolor=color, edgecolor=INK, lw=1.1))
    axes.text(x, y, text, ha="center", va="center", color=INK, fontsize=10.5, linespacing=1.5)


def arrow(axes: Axes, *points: tuple[float, float], label: str = "", at: int = 0, above: bool = True) -> None:
    """Draw a signal along points, with its name at the middle of one of its pieces."""
    *bends, end = points
    axes.plot(*zip(*points[:-1], strict=True), color=INK, lw=1.2)
    axes.annotate(
        "", end, bends[-1], arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.2, "shrinkA": 0, "shrinkB": 0}
    )
    if label:
        (a, b), (c, d) = points[at], points[at + 1]
        gap = 0.14 if above else -0.14
        axes.text(
            (a + c) / 2, (b + d) / 2 + gap, label, ha="center", va="bottom" if above else "top", color=INK, fontsize=10
        )


def told(axes: Axes, y: float, text: str) -> None:
    """Write what a figure shows along its top."""
    axes.text(0.4, y, text, ha="left", va="center", color=COLORS["mean"], fontsize=10)


def canvas(width: float, height: float) -> tuple[Figure, Axes]:
    """Return a figure in which a unit is 0.62 inches, and its bare axes."""
    figure = Figure(figsize=(0.62 * width, 0.62 * height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0, width), ylim=(0, height), aspect="equal")
    axes.axis("off")
    return figure, axes


def forward() -> Figure:
    """Return the system: the shaping filter's wind and the vehicle's own noises into the vehicle, forward in time."""
    figure, axes = canvas(16.6, 5.4)
    box(axes, 4.4, 4.2, "shaping filter\n$dz/dh = Fz + Gn$", WIND, 3.2)
    box(axes, 8.0, 4.2, "+", SUM, 0.7, 0.7)
    box(axes, 11.4, 4.2, "vehicle and its control\n$\\dot x = Ax + Bw + Eu$", VEHICLE, 3.8)
    box(axes, 4.4, 1.2, "first-order filters\n$\\dot z = -z/\\tau + \\sqrt{2/\\tau}\\,w$", WIND, 3.6)
    arrow(axes, (0.4, 4.2), (2.8, 4.2), label="white noise $n$")
    arrow(axes, (6.0, 4.2), (7.65, 4.2), label="$H z$")
    arrow(axes, (8.0, 2.6), (8.0, 3.85))
    axes.text(8.0, 2.5, "mean wind $\\bar W(h)$", ha="center", va="top", color=INK, fontsize=10)
    arrow(axes, (8.35, 4.2), (9.5, 4.2), label="$W(t)$")
    arrow(axes, (13.3, 4.2), (16.2, 4.2), label="responses $y = Cx$", at=0)
    axes.text(
        14.8, 3.95, "bending moment, angle\nof attack, engine angle", ha="center", va="top", color=INK, fontsize=9
    )
    arrow(axes, (0.4, 1.2), (2.6, 1.2), label="white noises")
    arrow(axes, (6.2, 1.2), (11.4, 1.2), (11.4, 3.55), label="thrust, centre of pressure", at=0)
    axes.text(
        0.4, 5.15, "forward: time runs from $t_0$ to $t_2$", ha="left", va="center", color=COLORS["mean"], fontsize=10
    )
    return figure


def adjoint() -> Figure:
    """Return the adjoint: every arrow turned about, an impulse at the response, integrated backward."""
    figure, axes = canvas(16.6, 5.0)
    box(axes, 11.4, 3.4, "adjoint of the vehicle\n$\\dot\\lambda = -A^T\\lambda$", VEHICLE, 3.8)
    box(axes, 4.4, 3.4, "adjoint of the filter\n$F^T,\\ H^T$ in, $G^T$ out", WIND, 3.4)
    arrow(axes, (16.2, 3.4), (13.3, 3.4), label="$\\lambda(t_2) = C_i^T$")
    axes.text(14.8, 3.15, "the response asked for,\nan impulse at $t_2$", ha="center", va="top", color=INK, fontsize=9)
    arrow(axes, (9.5, 3.4), (6.1, 3.4), label="$g_{i,W}(t_2, t)$")
    arrow(axes, (7.8, 3.4), (7.8, 1.35), label="")
    box(axes, 7.8, 0.95, "$\\int g_{i,W}\\,\\bar W\\,dt + G_i\\bar W(t_2)$ = mean", SUM, 5.2, 0.8)
    arrow(axes, (2.7, 3.4), (1.7, 3.4), (1.7, 1.35))
    axes.text(2.15, 3.55, "$g_i = B^T\\lambda$", ha="right", va="bottom", color=INK, fontsize=10)
    box(axes, 2.2, 0.95, "$\\int |g_i|^2\\,dt$ = variance", SUM, 3.4, 0.8)
    told(axes, 4.75, "adjoint: time runs from $t_2$ back to $t_0$; one run gives one response at $t_2$ to all inputs")
    return figure


def sources() -> Figure:
    """Return how the same run of the adjoint gives the variance from every source by itself."""
    figure, axes = canvas(16.6, 6.6)
    box(axes, 3.4, 3.1, "adjoint of the\nwhole system\n$\\dot\\lambda = -A^T\\lambda$", VEHICLE, 3.4, 4.4)
    arrow(axes, (0.4, 3.1), (1.7, 3.1), label="$C_i^T$")
    names = ("wind", "thrust", "centre of pressure", "at the start")
    parts = ("$B_W^T\\lambda$", "$B_T^T\\lambda$", "$B_P^T\\lambda$", "$\\lambda(t_0)$")
    squares = ("$\\int |g_W|^2\\,dt$", "$\\int |g_T|^2\\,dt$", "$\\int |g_P|^2\\,dt$", "$\\lambda^T P_0\\,\\lambda$")
    for k, (name, part, square) in enumerate(zip(names, parts, squares, strict=True)):
        y = 4.9 - 1.2 * k
        arrow(axes, (5.1, y), (8.0, y), label=f"{name}: {part}")
        box(axes, 9.4, y, square, SUM, 2.8, 0.8)
        arrow(axes, (10.8, y), (13.0, y))
    box(axes, 13.5, 3.1, "+", SUM, 1.0, 4.4)
    arrow(axes, (14.0, 3.1), (16.2, 3.1), label="$\\mathrm{Var}\\ y_i(t_2)$")
    told(axes, 6.25, "sources are independent: their variances stand by themselves, and add up")
    return figure


DRAWN = {"method_forward": forward, "method_adjoint": adjoint, "method_sources": sources}


def draw(folder: Path) -> list[Path]:
    """Write the figures to a folder; return their files."""
    written = []
    with rc_context({**STYLE, "mathtext.fontset": "dejavusans"}):
        for name, figure in DRAWN.items():
            written.append(folder / f"{name}.png")
            figure().savefig(written[-1], dpi=150)
    return written


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else FIGURES)
