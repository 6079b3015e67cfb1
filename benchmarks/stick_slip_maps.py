"""Borders of stick-slip on a uniform string against those of public maps.

``python -m benchmarks.stick_slip_maps [--cells 1000]`` runs ten rows of the maps of Aarsnes
and van de Wouw (J. Sound Vib. 444, 2019; see `tests.strings.public_map`), all 30 speeds of each, in
some ten minutes: modes of the string and the event-driven integrator, and waves by characteristics
without either. It prints how many cells of the grid each border is off. With ``--cells`` the string
has a material damping that takes from axial waves what first-order upwind on so many cells does;
the stored maps have 1000.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from tests.strings.public_map import (
    BORDERS,
    STICKS,
    public_case,
    speeds,
    swing,
    swing_by_characteristics,
    upwind_retardation,
)


def last_sticking(swings: list[float]) -> int:
    """Return the place of the last speed that sticks, -1 if none does."""
    return max((i for i, value in enumerate(swings) if value >= STICKS), default=-1)


def main() -> None:
    """Print a line a row, and how many rows agree."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=0)
    cells = parser.parse_args().cells
    close: list[bool] = []
    for (cutting, feed), (sticking, _) in BORDERS.items():
        began, row = time.perf_counter(), speeds(feed)
        public = int(np.argmin(abs(np.log(row / sticking))))
        ours = []
        for speed in row.tolist():
            damped = upwind_retardation(cells, speed) if cells else 0.0
            ours.append(swing(*public_case(cutting, feed, speed, retardation=damped), rtol=1e-4))
        told = f"public {row[public]:.3f}, ours {row[last_sticking(ours)]:.3f}"
        off = last_sticking(ours) - public
        close.append(abs(off) <= 1)
        if not cells:
            waves = [swing_by_characteristics(cutting, feed, speed) for speed in row.tolist()]
            apart = last_sticking(waves) - last_sticking(ours)
            told += f" and {apart:+d} cells from it by characteristics"
        elapsed = time.perf_counter() - began
        print(f"Ka {cutting}, V0 {feed:.4g}: {told}, {off:+d} cells, {elapsed:.0f} s", flush=True)
    print(f"{sum(close)} of {len(close)} rows within one cell of the public border")


if __name__ == "__main__":
    main()
