"""Test vectors of an exported controller: what goes in, sample by sample, and what comes out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.tableio import csv_text
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.interpolation import BoolArray, IntArray
from drillctrl.tables.recorded import RecordedMotion
from drillctrl.tables.sampled import SampledController
from drillctrl.tables.stepped import SteppedController

# Of a motion that is made up.
_SAMPLES = 240
_MOST = 100_000


@dataclass(frozen=True, eq=False)
class Vectors:
    """Samples of a motion and what the controller makes of them.

    Attributes
    ----------
    outputs : array, (n, p)
        What is measured.
    places : array, (n, 3)
        Coordinates on the table's axes.
    delay, elapsed, other, limit : array, (n,)
        As for a step in C.
    enable : bool array, (n,)
        Whether it is switched on.
    command : array, (n,)
        u.
    vouched : bool array, (n,)
        Whether the table vouches for the gains.
    status : int array, (n,)
        Sum of bits.
    """

    outputs: FloatArray
    places: FloatArray
    delay: FloatArray
    elapsed: FloatArray
    other: FloatArray
    limit: FloatArray
    enable: BoolArray
    command: FloatArray
    vouched: BoolArray
    status: IntArray

    def csv(self, table: GainTable) -> str:
        """Return the text of a CSV file, a row a sample, in the units of the table."""
        structure = table.structure
        names = [*structure.outputs, *(axis.name for axis in table.grid.axes), "delay", "enable"]
        names += ["elapsed", "other", "limit", "u", "vouched", "status"]
        columns = [
            *(map(repr, values.tolist()) for values in self.outputs.T),
            *(map(repr, values.tolist()) for values in self.places.T),
            map(repr, self.delay.tolist()),
            map(str, self.enable.astype(int).tolist()),
            *(map(repr, v.tolist()) for v in (self.elapsed, self.other, self.limit, self.command)),
            map(str, self.vouched.astype(int).tolist()),
            map(str, self.status.tolist()),
        ]
        units = "dimensionless" if table.grid.rig is None else "SI"
        header = [f"Inputs of the controller and what it has to answer (u to status); {units}"]
        return csv_text(names, zip(*columns, strict=True), header)


def vectors_of(
    table: GainTable,
    controller: SampledController,
    motion: FloatArray | RecordedMotion | None = None,
) -> Vectors:
    """Return test vectors of a controller.

    Parameters
    ----------
    table, controller : GainTable, SampledController
        What is exported.
    motion : array, (n, p), or RecordedMotion, optional
        Recorded outputs, a row a sample, replayed in the middle of the table or where they were
        recorded. By default one is made up that sticks and slips, meets the limit, leaves the
        table, freezes, stands still in time, and is switched off and on.

    Raises
    ------
    InputError
        If a recorded motion has other columns than the table has outputs, no or too many
        rows, or a number that is not finite.
    """
    settings, count = controller.settings, len(table.structure.outputs)
    made_up = motion is None
    given = motion if isinstance(motion, RecordedMotion) else None
    if motion is None:
        outputs = _made_up(controller, count)
    else:
        outputs = np.asarray(motion if given is None else given.outputs, dtype=float)
        wanted = f"finite, 1 to {_MOST} rows of {count}: {', '.join(table.structure.outputs)}"
        if outputs.ndim != 2 or outputs.shape[1] != count or not 1 <= len(outputs) <= _MOST:
            raise InputError("motion", f"of shape {outputs.shape}", wanted)
        if not np.isfinite(outputs).all():
            raise InputError("motion", "not finite", wanted)
    rows = len(outputs)
    low, high = (np.array([ticks[end] for ticks in controller.axes]) for end in (0, -1))
    k = np.arange(rows)
    sway = np.sin(2.0 * np.pi * k / rows)[:, None] if made_up else np.zeros((rows, 1))
    places = (low + high) / 2.0 + 0.45 * (high - low) * sway
    if given is not None and given.places is not None:
        places = given.places
    elapsed = np.full(rows, settings.period)
    enable = k >= min(8, rows // 4)
    other, limit = np.zeros(rows), np.full(rows, settings.limit)
    if made_up:
        places[rows // 2 : rows // 2 + 12] = 3.0 * high
        elapsed[100:106] = 0.0
        enable[160:170] = False
        other[:20] = 0.3 * settings.limit
        limit[200:210] = 0.5 * settings.limit
    delay = np.full(rows, 0.9 * (settings.depth - 3) * settings.period)
    if given is not None and given.delay is not None:
        delay = given.delay
    steps = SteppedController(controller, count)
    answers: list[tuple[float, bool, int]] = []
    for row in range(rows):
        steps.elapsed, steps.other, steps.limit = elapsed[row], other[row], limit[row]
        command = steps.step(
            outputs[row].tolist(), places[row].tolist(), delay[row], bool(enable[row])
        )
        answers.append((command, steps.vouched, steps.status))
    u, vouched, status = (np.array(values) for values in zip(*answers, strict=True))
    return Vectors(outputs, places, delay, elapsed, other, limit, enable, u, vouched, status)


def _made_up(controller: SampledController, count: int) -> FloatArray:
    """Return outputs that grow until they command more than the limit, and stick on the way."""
    gains = np.abs(np.array(controller.node_gains)).reshape(-1, 2, count).sum(axis=1).max(axis=0)
    size = controller.settings.limit / (count * np.maximum(gains, 1e-12 * gains.max() or 1.0))
    k = np.arange(_SAMPLES)
    # A sine whose lower part is cut off: the bit stands.
    wave = np.maximum(np.sin(2.0 * np.pi * k / 37.0), -0.6) + 1e-3 * np.sin(k)
    wave *= np.minimum(k / 60.0, 4.0)
    shift = [np.roll(wave, 9 * i) for i in range(count)]
    outputs = np.column_stack(shift) * np.where(gains > 0.0, size, 1.0)
    outputs[210:220] = outputs[210]
    return np.asarray(outputs)
