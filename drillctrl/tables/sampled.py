"""A table as a sampled controller: what its source says in every language."""

from __future__ import annotations

import hashlib
import textwrap
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.gain_units import rig_gain_units
from drillctrl.tables.document import plain_values, to_document
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.grid import Grid
from drillctrl.tables.interpolation import CONSTANT, UNSAFE

# A ring of samples longer than this fits no drive.
_DEEPEST = 1_000_000


@dataclass(frozen=True)
class SampledController:
    """Numbers and words of a controller's source.

    Attributes
    ----------
    period, limit : float
        Sampling period and largest |u|, in the units of the table.
    axes : tuple of tuple of float
        Ticks of the three axes.
    node_gains : tuple of float
        Entries of K1, then K2, node by node, in the units of the table.
    cell_mode : tuple of int
        For each cell the position of its constant gains plus 1, 0 for interpolation, −1
        where the table does not vouch.
    cell_gains : tuple of float
        Entries of K1, then K2, of the cells with constant gains.
    words : dict of str to str
        What the templates of all languages name.
    reference : tuple of str
        Lines that say what the table was made for.
    """

    period: float
    limit: float
    axes: tuple[tuple[float, ...], ...]
    node_gains: tuple[float, ...]
    cell_mode: tuple[int, ...]
    cell_gains: tuple[float, ...]
    words: dict[str, str]
    reference: tuple[str, ...]

    @property
    def stamp(self) -> str:
        """Eight hexadecimal digits that no other controller shares."""
        return hashlib.sha256(repr(self).encode()).hexdigest()[:8]


class Sampling(NamedTuple):
    """Checked settings of a controller, and what follows from them.

    Attributes
    ----------
    period, limit : float
        As for `export_c`.
    depth : int
        Samples that the ring holds: the longest delay, what is in between two, and the newest.
    ramp : int
        Samples of the switch-on.
    """

    period: float
    limit: float
    depth: int
    ramp: int


def checked_sampling(
    grid: Grid,
    structure: FeedbackStructure,
    period: float,
    limit: float,
    ramp: int | None,
) -> Sampling:
    """Check what a controller is to be, for which no gains need be known.

    Parameters
    ----------
    grid, structure : Grid, FeedbackStructure
        Of the table.
    period, limit, ramp
        As for `export_c`.

    Raises
    ------
    InputError
        As `export_c` does.
    """
    step = checked_number("period", period, 0.0, 1e6, open_low=True)
    bound = checked_number("limit", limit, 0.0, 1e9, open_low=True)
    # The words go into comments, which other names might end.
    known = grid.plant.output_names
    if not set(structure.outputs) <= set(known):
        raise InputError("outputs", list(structure.outputs)[:4], f"of {', '.join(known)}")
    if len(structure.inputs) != 1:
        raise InputError("structure", structure.name, "one with a single input")
    if grid.rig is not None and rig_gain_units(structure, grid.plant, grid.rig) is None:
        raise InputError("structure", structure.name, "torque fed back from θ and θ'")
    longest = max(point.delay for point in grid.points)
    longest *= grid.rig.time_scale if grid.rig is not None else 1.0
    # A period that is tiny makes a number of samples that is none.
    if not longest / step < _DEEPEST:
        least = longest / _DEEPEST
        raise InputError("period", step, f"above {least:g}, for a delay of {longest:g}")
    whole = int(longest / step)
    # By default as long as the delayed outputs take to come in.
    count = whole if ramp is None else checked_integer("ramp", ramp, 0, 10**9)
    return Sampling(step, bound, whole + 3, count)


def sampled_controller(
    table: GainTable, name: str, period: float, limit: float, ramp: int | None
) -> SampledController:
    """Collect what the source of a controller says.

    Parameters
    ----------
    table, name, period, limit, ramp
        As for `export_c`.

    Raises
    ------
    InputError
        As `export_c` does.
    """
    grid, structure, rig = table.grid, table.structure, table.grid.rig
    step, bound, depth, count = checked_sampling(grid, structure, period, limit, ramp)
    factors = rig_gain_units(structure, grid.plant, rig)
    scale = np.array([factor for factor, _ in factors]) if factors else np.ones(1)
    mode = table.cells.mode
    constant = mode == CONSTANT
    listed = np.where(constant, np.cumsum(constant), np.where(mode == UNSAFE, -1, 0))
    bounds = zip(structure.entry_names, structure.flat_lower, structure.flat_upper, strict=True)
    groups = plain_values(table.grid.reference)
    # Those that vary over the grid are axes, and λ does with ψ.
    varying = (*grid.names, "lam", "rock_strength")
    given = {k: v for k, v in groups.items() if k not in varying}
    text = ", ".join(f"{k} {v:g}" for k, v in given.items())
    law = "u = K1 Y(t) + K2 Y(t - delay)"
    words = {
        "name": name,
        "law": f"{law}, in units of the torsional stiffness, on the bit in its sense of rotation"
        if rig is None
        else f"{law}, a torque in N m on the bit in its sense of rotation",
        "delay": f"tau0 = 2 pi/({table.grid.points[0].blades:g} omega0)"
        if rig is None
        else f"tau0 = 2 pi/({rig.blades:g} x rotary speed in rad/s), in s",
        "names": ", ".join(structure.outputs),
        "units": "dimensionless" if rig is None else "rad, rad/s, s, N m",
        "sampling": f"every {step:g}{'' if rig is None else ' s'}, "
        f"magnitude of u at most {bound:g}{'' if rig is None else ' N m'}, "
        f"switched on over {count} samples",
        "axes": ", ".join(f"{axis.name} ({axis.unit})" for axis in table.grid.axes),
        "bounds": ", ".join(f"{entry} {low:g}..{high:g}" for entry, low, high in bounds),
        "trials": trial_words(table),
        "checksum": to_document(table).header["checksum"],
        "outputs": str(len(structure.outputs)),
        "depth": str(depth),
        "ramp": str(count),
    }
    return SampledController(
        step,
        bound,
        tuple(axis.values for axis in table.grid.axes),
        tuple((table.entries * scale).ravel().tolist()),
        tuple(listed.tolist()),
        tuple((table.entries_of(table.cells.gains[constant]) * scale).ravel().tolist()),
        words,
        tuple(textwrap.wrap(f"{'Groups' if rig is None else 'Rig (SI)'}: {text}", 80)),
    )


def trial_words(table: GainTable) -> str:
    """Say what trial runs on the nonlinear motion vouch for."""
    if not table.tried:
        return "NONE: these gains have not been tried on the nonlinear motion"
    refused = len(table.refusals)
    text = f"gains of all {len(table.gains)} nodes tried on the nonlinear motion"
    return f"{text}; {refused} refused, control is off there" if refused else text
