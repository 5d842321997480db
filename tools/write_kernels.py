"""Writes model/wind/data/interlevel_kernels.csv: the knots of the wind's correlation, by month and component.

    python tools/write_kernels.py [FILE]

Without FILE the shipped one is written again. Minutes of computing: 26 fits.
"""

from __future__ import annotations

import sys
from pathlib import Path

from ascentwind.model.wind.range_reference import KERNELS, PERIODS, WIND_DATA
from ascentwind.model.wind.record import COMPONENTS
from ascentwind.runners.wind.correlation_fit import QUANTITIES, march_kernel, reconstructed_kernel


def write_kernels(file: Path) -> None:
    """Write the knots of all months and components, as shipped in model/wind/data."""
    lines = [
        "# computed: two-part kernel by month and component (runners/wind/correlation_fit.py), knots fitted to level",
        "# correlations of Cape Canaveral soundings 2008-2022; March by hand; assumed below 1.5 km and above 10.7 km;",
        "# 'third_order' is March zonal with smoothness 0.5, all others have 0.7; scales in m",
        "month,component,quantity,altitude [m],value",
    ]
    cases = [(p, c) for p in PERIODS for c in COMPONENTS] + [("march", "third_order")]
    for period, component in cases:
        kernel = march_kernel(component) if component == "third_order" else reconstructed_kernel(period, component)
        for quantity, (altitude, values) in zip(
            QUANTITIES, (kernel.long_scale, kernel.short_scale, kernel.short_fraction), strict=True
        ):
            lines += [f"{period},{component},{quantity},{h:g},{v:.6g}" for h, v in zip(altitude, values, strict=True)]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_kernels(Path(sys.argv[1]) if len(sys.argv) > 1 else WIND_DATA / KERNELS)
