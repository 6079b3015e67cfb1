"""Test vectors of a drive's law: what goes in, sample by sample, and what comes out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.tableio import csv_text
from drillctrl.strings.drive_sampled import SampledDrive
from drillctrl.strings.drive_stepped import SteppedDrive
from drillctrl.tables.interpolation import BoolArray, IntArray

_SAMPLES, _MOST_FROZEN = 240, 1000
# Mean speed and swing of a drive on a string that sticks and slips, rad/s.
_SPEED, _SWING = 12.0, 3.0


@dataclass(frozen=True, eq=False)
class DriveVectors:
    """Samples of a motion and what the law makes of them.

    Attributes
    ----------
    names : tuple of str
        Of the columns that go in: ``speed``, ``set_point``, ``torque``, then the law's axes.
    inputs : array, (n, k)
        These, SI.
    elapsed, limit : array, (n,)
        s and N m.
    enable : bool array, (n,)
        Whether it is switched on.
    command : array, (n,)
        Torque, N m.
    vouched : bool array, (n,)
        Whether there is a law for the place.
    status : int array, (n,)
        Sum of bits.
    """

    names: tuple[str, ...]
    inputs: FloatArray
    elapsed: FloatArray
    limit: FloatArray
    enable: BoolArray
    command: FloatArray
    vouched: BoolArray
    status: IntArray

    def csv(self) -> str:
        """Return the text of a CSV file, a row a sample."""
        names = [*self.names, "elapsed", "limit", "enable", "u", "vouched", "status"]
        reals = [*self.inputs.T, self.elapsed, self.limit, self.command]
        *before, command = [[repr(value) for value in column.tolist()] for column in reals]
        whole = [
            [str(int(value)) for value in column.tolist()]
            for column in (self.enable, self.vouched, self.status)
        ]
        header = ["Inputs of the controller and what it has to answer (u to status); SI"]
        return csv_text(names, zip(*before, whole[0], command, *whole[1:], strict=True), header)


def drive_vectors(law: SampledDrive) -> DriveVectors:
    """Return a made-up motion and what a law answers.

    The drive swings more and more, is taken over from another controller, switched off and on,
    sees its signals lost and jump, its clock stand, its limit fall, its place leave the table, its
    encoder freeze. What it gave is what it commanded the sample before.
    """
    rows = _SAMPLES + min(law.frozen, _MOST_FROZEN) + 8
    k = np.arange(rows)
    swing = np.maximum(np.sin(2.0 * np.pi * k / 61.0), -0.6) + 1e-3 * np.sin(k)
    speed = _SPEED + _SWING * np.minimum(k / 80.0, 2.0) * swing
    speed[120 : 126 + min(law.hold, 20)] = 1e4
    # No law keeps to its limits of torque and rate then.
    speed[180:182], speed[182:184] = 5.0 * _SPEED, 0.0
    speed[_SAMPLES:] = speed[_SAMPLES]
    places = [
        0.5 * (low + high) + 0.45 * (high - low) * np.sin(2.0 * np.pi * (i + 1) * k / rows)
        for i, (low, high) in enumerate((values[0], values[-1]) for _, values in law.axes)
    ]
    for column, (_, values) in zip(places, law.axes, strict=True):
        if len(values) > 1:
            column[rows // 2 : rows // 2 + 12] = 1.2 * values[-1]
    elapsed, limit = np.full(rows, law.period), np.full(rows, law.limit)
    elapsed[100:106] = 0.0
    limit[200:210] = 1e-3 * law.limit
    enable = (k >= 8) & ((k < 160) | (k >= 170))
    steps, given = SteppedDrive(law), 0.3 * law.limit
    torques, answers = np.zeros(rows), []
    for i in range(rows):
        steps.elapsed, steps.limit = float(elapsed[i]), float(limit[i])
        torques[i] = given
        at = [float(column[i]) for column in places]
        command = steps.step(float(speed[i]), _SPEED, given, at, bool(enable[i]))
        answers.append((command, steps.vouched, steps.status))
        given = command if enable[i] else given
    u, vouched, status = (np.array(values) for values in zip(*answers, strict=True))
    names = ("speed", "set_point", "torque", *(name for name, _ in law.axes))
    inputs = np.column_stack([speed, np.full(rows, _SPEED), torques, *places])
    return DriveVectors(names, inputs, elapsed, limit, enable, u, vouched, status)
