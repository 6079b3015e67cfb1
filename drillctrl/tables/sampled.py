"""A table as a sampled controller: what its source says in every language."""

from __future__ import annotations

import hashlib
import textwrap
from dataclasses import dataclass

import numpy as np

from drillctrl.drilling.gain_units import rig_gain_units
from drillctrl.tables.document import plain_values, to_document
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.interpolation import CONSTANT, SLACK, UNSAFE
from drillctrl.tables.settings import Options, Settings, checked_settings


@dataclass(frozen=True)
class SampledController:
    """Numbers and words of a controller's source.

    Attributes
    ----------
    settings : Settings
        What it does beside its law.
    axes : tuple of tuple of float
        Ticks of the axes.
    node_gains : tuple of float
        Entries of K1, then K2, node by node, in the units of the table.
    cell_mode : tuple of int
        For each cell the position of its constant gains plus 1, 0 for interpolation, −1
        where the table does not vouch.
    cell_gains : tuple of float
        Entries of K1, then K2, of the cells with constant gains.
    words : dict of str to str or tuple of str
        What the templates of all languages name.
    reference : tuple of str
        Lines that say what the table was made for.
    """

    settings: Settings
    axes: tuple[tuple[float, ...], ...]
    node_gains: tuple[float, ...]
    cell_mode: tuple[int, ...]
    cell_gains: tuple[float, ...]
    words: dict[str, str | tuple[str, ...]]
    reference: tuple[str, ...]

    def ends(self, slack: float = SLACK) -> list[tuple[float, float]]:
        """Return between what coordinates of each axis the table may vouch.

        Parameters
        ----------
        slack : float
            Share of a coordinate by which the arithmetic rounds it.
        """
        room = [slack * max(abs(ticks[0]), abs(ticks[-1])) for ticks in self.axes]
        return [
            (ticks[0] - part, ticks[-1] + part) for ticks, part in zip(self.axes, room, strict=True)
        ]

    @property
    def stamp(self) -> str:
        """Eight hexadecimal digits that no other controller shares."""
        return hashlib.sha256(repr(self).encode()).hexdigest()[:8]


def sampled_controller(
    table: GainTable, name: str, period: float, limit: float, options: Options
) -> SampledController:
    """Collect what the source of a controller says.

    Parameters
    ----------
    table, name, period, limit
        As for `export_c`.
    options : Options
        Those that are not the default.

    Raises
    ------
    InputError
        As `export_c` does.
    """
    grid, structure, rig = table.grid, table.structure, table.grid.rig
    settings = checked_settings(grid, structure, period, limit, options)
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
        "sampling": f"every {settings.period:g}{'' if rig is None else ' s'}, "
        f"magnitude of u at most {settings.limit:g}{'' if rig is None else ' N m'}, "
        f"switched on over {settings.ramp} samples",
        "care": care_words(settings, "" if rig is None else " N m"),
        "axes": ", ".join(f"{axis.name} ({axis.unit})" for axis in table.grid.axes),
        "bounds": ", ".join(f"{entry} {low:g}..{high:g}" for entry, low, high in bounds),
        "trials": trial_words(table),
        "checksum": to_document(table).header["checksum"],
    }
    return SampledController(
        settings,
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
    text = f"{text}; {refused} refused, control is off there" if refused else text
    late = len(table.cautions)
    return f"{text}; switch on once the bit turns, for {late} do harm before" if late else text


def care_words(settings: Settings, unit: str) -> tuple[str, ...]:
    """Say in lines what a controller does where it should not follow its law."""
    fade = f"over {settings.fade} samples"
    outside = {
        "fade": f"Where the table does not vouch the last gains that it vouched for fade {fade}.",
        "hold": "Where the table does not vouch the last gains that it vouched for stay.",
    }
    does = f"fade the command {fade}" if settings.watched else "are reported"
    text = [
        outside[settings.outside],
        f"{settings.hold} samples that are none in a row are replaced by the last good one; "
        f"then the command fades {fade}.",
        f"{settings.frozen} equal samples in a row {does}.",
    ]
    if settings.rate is not None:
        text.append(f"u changes by at most {settings.rate:g}{unit} a sample.")
    if settings.release:
        text.append(f"Switched off, u falls to 0 over {settings.release} samples.")
    return tuple(textwrap.wrap(" ".join(text), 80))
