"""Does linear stability predict what the nonlinear string does? Tried over a plane."""

from __future__ import annotations

from typing import Any

import numpy as np

from drillctrl.paper.agreement import stated
from drillctrl.paper.controlled import AT_ORBIT, KICK
from drillctrl.paper.panels import Reproduced
from drillctrl.simulation.controller import Controller
from drillctrl.studies.campaign import campaign as run_campaign
from drillctrl.tables.grid import dimensionless_grid, linear_axis

SIZES = (0.01, 1.0)
LARGEST = 10.0


def campaign() -> Reproduced:
    """Simulate the controller of Fig. 15 over ω0 × δ0 after disturbances of many sizes."""
    grid = dimensionless_grid(
        linear_axis("omega0", 4.0, 24.0, 9), linear_axis("delta0", 0.5, 12.5, 9), 14.0
    )

    found = run_campaign(
        grid,
        Controller(*AT_ORBIT),
        disturbance=KICK,
        sizes=SIZES,
        largest=LARGEST,
        sharpness=1.25,
    )
    alpha, settled = found.spectral_abscissa, found.outcomes == "settled"
    # Where a run decays or grows too slowly it does not tell.
    clear = abs(alpha) > 0.02
    plane = "Case 1 (−3.82, 3.61) on 9 × 9 points of ω0 4-24 × δ0 0.5-12.5, |α| > 0.02"
    edge = found.basin[clear & (alpha < 0.0)]
    met = edge[~np.isnan(edge[:, 1]), 0]
    basin = f"at {len(edge) - len(met)} of {len(edge)} stable points all sizes up to {LARGEST:g}"
    if met.size:
        basin += f" settle, at the others up to {met.min():.3g} and more"
    rows = []
    for k, (size, note) in enumerate(zip(SIZES, (plane, basin), strict=True)):
        good, many = int((settled[:, k] == (alpha < 0.0))[clear].sum()), int(clear.sum())
        after = f"x' = θ' = {size:g}"
        rows.append(
            stated(
                "Sect. 4.2",
                f"the nonlinear motion settles where the linear loop is stable ({after})",
                f"{good} of {many} points agree",
                good == many,
                note,
            )
        )
    table: list[dict[str, Any]] = found.to_dict()["rows"]
    return Reproduced(found.plot(), rows, table)
