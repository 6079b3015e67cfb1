"""A picture of drives: what they return, their impedance, and what they damp, over frequency."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.figure import BLUE, GREEN, GREY, ORANGE, new_figure, plain_ticks
from drillctrl.strings.drive_roots import DriveRoot

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Curves = tuple[FloatArray, FloatArray, ComplexArray, Iterable[DriveRoot]]

_COLOURS = (GREY, BLUE, GREEN, ORANGE, "#CC79A7", "#56B4E9", "#E69F00")


def plot_drives(drives: Mapping[str, Curves], pipe: float, title: str = "") -> Figure:
    """Draw ``|r|``, ``|Z|`` and Re Z over ζ, and the damping of modes with a free bit.

    Parameters
    ----------
    drives : mapping
        Name → frequencies in Hz, ``|r|``, Z in N m s/rad, and roots.
    pipe : float
        ζ of the uppermost pipe, N m s/rad.
    title : str
        Whose string it is.
    """
    figure = new_figure(7.0, 9.0)
    figure.suptitle(title, fontsize="medium")
    returned, impedance, damping = figure.subplots(3, 1, sharex=True)
    grows = False
    for i, (name, (frequencies, reflection, z, roots)) in enumerate(drives.items()):
        colour = _COLOURS[i % len(_COLOURS)]
        returned.plot(frequencies, reflection, color=colour, label=name)
        impedance.plot(frequencies, np.abs(z) / pipe, color=colour, label=name)
        impedance.plot(frequencies, z.real / pipe, color=colour, ls="--", lw=0.8)
        shown = [root for root in roots if frequencies[0] <= root.frequency <= frequencies[-1]]
        grows = grows or any(root.damping_ratio < 0.0 for root in shown)
        damping.plot(
            [root.frequency for root in shown],
            [1e2 * root.damping_ratio for root in shown],
            color=colour,
            marker="o",
            ms=4,
            lw=0.8,
            label=name,
        )
    returned.axhline(1.0, color=GREY, lw=0.6)
    returned.set_ylabel("share of a wave returned\n|r|, dimensionless")
    returned.set_ylim(bottom=0.0)
    returned.legend(fontsize=8)
    impedance.set_yscale("symlog", linthresh=1.0)
    impedance.set_ylabel("|Z| (dashed: real part)\nover the pipe's, dimensionless")
    if grows:
        damping.set_yscale("symlog", linthresh=0.1)
        damping.axhline(0.0, color=GREY, lw=0.6)
    else:
        damping.set_yscale("log")
        plain_ticks(damping.yaxis)
    damping.set_ylabel("damping, % of critical")
    damping.set_xscale("log")
    plain_ticks(damping.xaxis)
    damping.set_xlabel("frequency, Hz")
    return figure
