"""docs/reproduction.md: our numbers beside the report's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined

from ...model.vehicle.noise_loads import NOISE_LOADS
from .as506.flight import FlightCheck
from .calibration import RULE, Calibration, Input
from .mean_wind import MeanWind
from .options import Effect
from .predictions import BENDING, Prediction, larger_sides
from .winds import WindComparison

SHORT = {
    "peak_mean": "peak mean",
    "sigma_75": "σ at 75 s",
    "rise_bending": "rise, bending",
    "rise_engine": "rise, engine",
    "bending_1": "mode 1",
    "bending_2": "mode 2",
}


@dataclass(frozen=True, eq=False)
class Reproduction:
    """All that the page shows."""

    predictions: Sequence[Prediction]
    effects: Sequence[Effect]
    winds: WindComparison
    checks: Sequence[FlightCheck]
    calibration: Calibration
    mean_wind: MeanWind


def page(found: Reproduction) -> str:
    """Return the page as Markdown."""
    environment = Environment(
        loader=PackageLoader(__package__ or "", "templates"),
        undefined=StrictUndefined,
        trim_blocks=False,
        keep_trailing_newline=True,
        autoescape=False,
    )
    first = found.effects[0]

    def effect_cells(effect: Effect) -> str:
        return " | ".join(_effect_cells(effect, first))

    peaks = [
        (name, float(larger_sides(s, "wind").sel(response=BENDING).max())) for name, s in found.winds.statistics.items()
    ]
    failed = [c.quantity for c in found.checks if not c.holds]
    return environment.get_template("reproduction.md.jinja").render(
        predictions=found.predictions,
        effects=found.effects,
        winds=peaks,
        checks=found.checks,
        calibration=found.calibration,
        scaled=found.mean_wind,
        forms=NOISE_LOADS,
        short=SHORT,
        number=number,
        published=lambda p: ("below " if p.bound == "below" else "") + number(p.value, p.unit),
        difference=_difference,
        effect_cells=effect_cells,
        percent=_percent,
        unit=lambda name: name.replace("1e6 ", "·10⁶ ").replace("m2", "m²").replace("deg", "°"),
        limit=lambda c: "" if c.limit is None else f"{c.limit:.3g}",
        failed=f"Outside its limit: {', '.join(failed)}." if failed else "All within their limits.",
        found=lambda i: _found(i, found.calibration),
        verdict=_verdict(found.calibration),
    )


def number(value: float, unit: str) -> str:
    """Return a number as people read it."""
    if unit == "N m":
        return f"{value / 1e6:.2f} MN m"
    if unit == "1":
        return f"{100 * value:.1f} %"
    return f"{value:.3g} {unit.replace('m2/s2', 'm²/s²')}"


def _percent(value: float) -> str:
    return f"{100 * value:+.1f} %"


def _difference(prediction: Prediction) -> str:
    p = prediction.published
    if p.bound == "below":
        return "met" if prediction.miss == 0 else "not met"
    if p.unit == "1":
        return f"{100 * (prediction.ours - p.value):+.1f} points"
    return _percent(prediction.miss)


def _effect_cells(effect: Effect, first: Effect) -> list[str]:
    own, base = effect.responses, first.responses
    assert base is not None
    cells = []
    for name in ("peak_mean", "sigma_75", "peak"):
        if own is None:
            cells.append("infinite")
        elif effect is first:
            cells.append(f"{getattr(own, name) / 1e6:.2f} MN m")
        else:
            cells.append(_percent(getattr(own, name) / getattr(base, name) - 1))
    engine = None if own is None else own.engine
    angles = (
        (engine, base.engine),
        (effect.sigma_attack, first.sigma_attack),
        (effect.sigma_engine, first.sigma_engine),
    )
    for value, reference in angles:
        if value is None:
            cells.append("")
        elif effect is first:
            cells.append(f"{57.29577951 * value:.2f}°")
        else:
            cells.append(_percent(value / reference - 1))
    cells.append("" if own is None else f"{100 * own.rise_bending:.1f} %")
    return cells


def _found(item: Input, calibration: Calibration) -> str:
    value = calibration.values[item.name]
    share = item.share(value)
    mark = " (lower bound)" if share < 0.005 else " (upper bound)" if share > 0.995 else ""
    return f"{value:.4g}{mark}"


def _verdict(calibration: Calibration) -> str:
    missed = [
        f"{t.what} ({_percent(t.miss(a))})"
        for t, a, met in zip(calibration.targets, calibration.after, calibration.met, strict=True)
        if not met
    ]
    if not missed:
        return f"All within {100 * RULE:.0f} %."
    bound = [i.what for i in calibration.inputs if "bound" in _found(i, calibration)]
    return f"Cannot be met within {100 * RULE:.0f} % at once: {'; '.join(missed)}. " + (
        f"At a bound: {', '.join(bound)}." if bound else "No input is at a bound."
    )
