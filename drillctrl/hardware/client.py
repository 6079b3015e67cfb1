"""The other end of the line: a controller in Python that answers the bench."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Callable, Sequence

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.hardware.wire import Address, Sample, pack_answer, unpack_sample
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.sampled import sampled_controller
from drillctrl.tables.settings import Options
from drillctrl.tables.stepped import SteppedController

Law = Callable[[Sample], Sequence[float]]
_AGAIN = 0.2


@checks_kinds
def answer_bench(
    address: Address, law: Law, *, outputs: int, inputs: int = 1, patience: float = 10.0
) -> int:
    """Answer the samples of a bench until it ends.

    Parameters
    ----------
    address : (str, int)
        Where the bench listens.
    law : callable
        From a `Sample` to as many inputs as are driven.
    outputs, inputs : int
        How many the bench sends and takes.
    patience : float
        Seconds without a sample after which the bench is given up.

    Returns
    -------
    int
        Samples that were answered.
    """
    family = socket.AF_INET6 if ":" in address[0] else socket.AF_INET
    answered = 0
    with socket.socket(family, socket.SOCK_DGRAM) as line:
        line.settimeout(_AGAIN)
        last = time.perf_counter()
        while time.perf_counter() - last < patience:
            if not answered:
                with contextlib.suppress(OSError):
                    line.sendto(pack_answer(0, (0.0,) * inputs), address)
            try:
                data, _ = line.recvfrom(2048)
            except OSError:
                continue
            sample = unpack_sample(data, outputs)
            if sample is None:
                continue
            if sample.sequence == 0:
                break
            last = time.perf_counter()
            line.sendto(pack_answer(sample.sequence, law(sample)), address)
            answered += 1
    return answered


def table_law(table: GainTable, period: float, limit: float, **options: object) -> Law:
    """Return the law of the controller that is exported of a table, operation by operation.

    Parameters
    ----------
    table : GainTable
        Over ω0, δ0 and ψ, or rotary speed, rate of penetration and rock strength.
    period, limit, **options
        As for the exports.

    Raises
    ------
    InputError
        If its axes are others, which no sample tells.
    """
    told = (
        ("omega0", "delta0", "psi"),
        ("rotary_speed", "penetration_rate", "rock_strength"),
    )
    names = tuple(axis.name for axis in table.grid.axes)
    if names not in told:
        wanted = f"over {', '.join(told[table.grid.rig is not None])}, which the bench tells"
        raise InputError("table", f"over {', '.join(names)}", wanted)
    given = Options(**options)  # type: ignore[typeddict-item]
    controller = sampled_controller(table, "bench", period, limit, given)
    steps = SteppedController(controller, len(table.structure.outputs))

    def law(sample: Sample) -> Sequence[float]:
        return [steps.step(sample.outputs, sample.points, sample.delay, True)]

    return law
