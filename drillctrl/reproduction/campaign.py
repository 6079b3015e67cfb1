"""Does linear stability predict what the nonlinear string does? Tried over a plane."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from drillctrl.delay_system import plant_system
from drillctrl.feedback import close_loop, preset_structure
from drillctrl.operating_point import OperatingPoint
from drillctrl.plotting import BLUE, GREY, ORANGE
from drillctrl.reproduction.agreement import stated
from drillctrl.reproduction.control import AT_ORBIT, KICK
from drillctrl.reproduction.panels import Reproduced, panels
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.run import simulate
from drillctrl.spectrum.roots import spectral_abscissa

SPEEDS = tuple(float(value) for value in np.linspace(4.0, 24.0, 9))
DEPTHS = tuple(float(value) for value in np.linspace(0.5, 12.5, 9))
SIZES = (0.01, 1.0)
# exp(−9) is what a run must decay by in its first three quarters to count as settled.
_DECAY = 12.0


def _outcome(point: OperatingPoint, alpha: float, size: float) -> str:
    duration = float(np.clip(_DECAY / abs(alpha), 60.0, 400.0))
    start = {name: size * value for name, value in KICK.items()}
    run = simulate(point, Controller(*AT_ORBIT), duration=duration, initial=start, rtol=1e-6)
    if run.status != "done":
        return run.status
    return "settled" if run.summary.settled else "not settled"


def campaign(tell: Callable[[int, int], None] | None = None) -> Reproduced:
    """Simulate the controller of Fig. 15 over ω0 × δ0 after small and unit disturbances."""
    structure = preset_structure(AT_ORBIT[0])
    table: list[dict[str, Any]] = []
    total = len(SPEEDS) * len(DEPTHS)
    for omega0 in SPEEDS:
        for delta0 in DEPTHS:
            if tell is not None:
                tell(len(table), total)
            point = OperatingPoint(omega0, delta0, 14.0)
            alpha = spectral_abscissa(close_loop(plant_system(point), structure, *AT_ORBIT[1:]))
            row: dict[str, Any] = {"omega0": omega0, "delta0": delta0, "spectral_abscissa": alpha}
            for size in SIZES:
                row[f"after {size:g}"] = _outcome(point, alpha, size)
            table.append(row)
    figure, axes = panels(1, 2)
    counts = {}
    # Too near the boundary a run of this length does not tell.
    clear = [row for row in table if abs(row["spectral_abscissa"]) > 0.03]
    for ax, size in zip(axes, SIZES, strict=True):
        for kind, marker, colour in (
            ("settled", "o", BLUE),
            ("not settled", "x", ORANGE),
            ("reverse rotation", "v", GREY),
        ):
            there = [row for row in table if row[f"after {size:g}"] == kind]
            ax.plot(
                [row["omega0"] for row in there], [row["delta0"] for row in there],
                marker, color=colour, linestyle="none", label=kind,
            )  # fmt: skip
        ax.set_xlabel("rotary speed ω0")
        ax.set_ylabel("depth of cut δ0")
        ax.set_title(f"after x' = θ' = {size:g}", fontsize="medium")
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.08), ncols=3, fontsize="small")
        agree = [
            (row[f"after {size:g}"] == "settled") == (row["spectral_abscissa"] < 0.0)
            for row in clear
        ]
        counts[size] = (sum(agree), len(agree))
    rows = [
        stated(
            "Sect. 4.2",
            f"the nonlinear motion settles where the linear loop is stable (x' = θ' = {size:g})",
            f"{good} of {many} points agree",
            good == many,
            "Case 1 (−3.82, 3.61) on 9 × 9 points of ω0 4-24 × δ0 0.5-12.5, |α| > 0.03; "
            + ("small motion" if size < 0.1 else "this large a disturbance can leave the basin"),
        )
        for size, (good, many) in counts.items()
    ]
    return Reproduced(figure, rows, table)
