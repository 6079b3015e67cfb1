"""The law of a top drive in the plant, which it closes: a string that is turned."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.bit_rock import BitRock
from drillctrl.drilling.block import Block
from drillctrl.drilling.coefficients import Coefficients
from drillctrl.drilling.drive import TopDrive
from drillctrl.drilling.plant import Plant, paper_plant
from drillctrl.drilling.quantities import Signal
from drillctrl.drilling.realisation import Late, Realisation
from drillctrl.drilling.sensors import Filtered, Lagging, LateInput
from drillctrl.strings.drive_control import DriveControl, Transfer
from drillctrl.strings.model import PipeString
from drillctrl.strings.rig import StringRig

LAW, MEASURED, INTEGRAL = "law", "measured_torque", "law_integral"


class DriveLaw(Block):
    """What a law asks of its drive, which does it; the torque is an output, ``law``.

    Where the drive does it, the integral of speed is the top's angle itself; where the law is an
    output alone, it is a state of its own, ``law_integral``, which a controller can keep from
    winding up at a limit. All else of A and B has states of its own.

    Parameters
    ----------
    control : DriveControl
        In SI.
    time, torque : float
        Units of time and torque in the plant, s and N m.
    inertia_ratio : float
        Inertia of the drive over the unit of inertia.
    acts : bool
        Whether the drive does it; else the law is an output alone, for a controller with limits
        and a clock to hand on.
    """

    control: DriveControl
    acts: bool

    def __init__(
        self,
        control: DriveControl,
        time: float,
        torque: float,
        inertia_ratio: float,
        acts: bool = True,
    ) -> None:
        super().__init__()
        self.__dict__.update(
            control=control, time=time, torque=torque, inertia_ratio=inertia_ratio, acts=acts
        )

    @property
    def form(self) -> Any:
        """The law and its units."""
        own = self.__dict__
        names = ("control", "time", "torque", "inertia_ratio", "acts")
        return DriveLaw, *(own[name] for name in names)

    def signals(self, made: Realisation, c: Coefficients, q: Any) -> Realisation:
        """Return the equations with the law's states and its output."""
        control: DriveControl = self.__dict__["control"]
        time, torque = self.__dict__["time"], self.__dict__["torque"]
        if control.torque:
            made = self._with_pipe_torque(made, c)
        suffix = "_filtered" if control.machine.encoder else ""
        integral, rest = without_integral(control.speed)
        asked, reference = ca.SX(1, len(made.states)), ca.SX(1, 4)
        # Output, gain of that output itself, transfer function of it.
        terms: list[tuple[str, float, Transfer]] = []
        if self.__dict__["acts"]:
            terms.append((f"phi{suffix}", -integral / torque, Transfer()))
        elif integral:
            made = _integrating(made, f"dphi{suffix}", -integral / torque)
            asked = ca.horzcat(asked, ca.SX(1))
        terms.append((f"dphi{suffix}", 0.0, _scaled(rest, time, -1.0 / (torque * time))))
        if control.torque:
            terms.append((MEASURED, 0.0, _scaled(control.torque, time, 1.0)))
        for name, gain, law in terms:
            place = made.output_names.index(name)
            a, b, row, through = companion(law)
            seen, led = made.C[place, :], made.R[place, :]
            names = [Signal(f"{LAW}_{name}{i + 1}", "number") for i in range(len(b))]
            made = _with_states(made, names, a, b, seen, led)
            asked = ca.horzcat(asked + (gain + through) * seen, ca.SX(ca.DM(row[None, :])))
            reference = reference + (gain + through) * led
        drive = made.B[:, made.input_names.index("drive")]
        if not self.__dict__["acts"]:
            pass
        elif control.machine.delay:
            late = Late(made.input_delays["drive"], drive @ asked)
            made = replace(made, late=(*made.late, late))
        else:
            made = replace(made, A=made.A + drive @ asked, T=made.T - drive @ reference)
        return made.with_output(Signal(LAW, "torque"), asked, reference)

    def _with_pipe_torque(self, made: Realisation, c: Coefficients) -> Realisation:
        """Return the equations with the pipe's torque, filtered, as a state and an output.

        It is J φ'' less the torque of the drive, and pulls the drive forward.
        """
        machine = self.__dict__["control"].machine
        inertia = self.__dict__["inertia_ratio"] * c.inertia
        constant = machine.torque_filter / self.__dict__["time"]
        turning, column = made.state_names.index("dphi"), made.input_names.index("drive")
        seen, through = inertia * made.A[turning, :], inertia * made.B[turning, column]
        if machine.lag:
            acting = made.state_names.index("drive_acting")
            seen[0, acting] = seen[0, acting] - 1
        else:
            through = through - 1
        signal = Signal(MEASURED, "torque")
        grown = _with_states(
            made, [signal], np.array([[0.0]]), np.array([1.0]), seen / constant,
            -inertia * made.T[turning, :] / constant,
        )  # fmt: skip
        a, b, e = grown.A[:, :], grown.B[:, :], grown.E[:, :]
        a[-1, -1], b[-1, column] = -1 / constant, through / constant
        # In a string of finitely many modes a load on the bit is felt at the top at once.
        e[-1, :] = inertia * made.E[turning, :] / constant
        row = ca.SX(1, len(grown.states))
        row[0, -1] = 1
        return replace(grown, A=a, B=b, E=e).with_output(signal, row, ca.SX(1, 4))


def _integrating(made: Realisation, name: str, gain: float) -> Realisation:
    """Return the equations with the integral of an output, times a gain, as a state."""
    place = made.output_names.index(name)
    state = [Signal(INTEGRAL, "torque")]
    row = made.C[place, :], made.R[place, :]
    return _with_states(made, state, np.zeros((1, 1)), np.array([gain]), *row)


def _with_states(
    made: Realisation, states: list[Signal], a: FloatArray, b: FloatArray, seen: ca.SX, led: ca.SX
) -> Realisation:
    """Return the equations with states z' = a z + b (seen X − led top)."""
    n, k = len(made.states), len(b)
    if not k:
        return made
    column = ca.SX(ca.DM(b[:, None]))
    grown = ca.SX(n + k, n + k)
    grown[:n, :n] = made.A
    grown[n:, :n], grown[n:, n:] = column @ seen, ca.SX(ca.DM(a))

    def taller(matrix: ca.SX) -> ca.SX:
        return ca.vertcat(matrix, ca.SX(k, matrix.shape[1]))

    late = tuple(
        Late(delay, ca.horzcat(taller(matrix), ca.SX(n + k, k))) for delay, matrix in made.late
    )
    return replace(
        made,
        states=(*made.states, *states),
        A=grown,
        E=taller(made.E),
        B=taller(made.B),
        T=ca.vertcat(made.T, -column @ led),
        C=ca.horzcat(made.C, ca.SX(made.C.shape[0], k)),
        late=late,
    )


def without_integral(law: Transfer) -> tuple[float, Transfer]:
    """Return k and the rest of a transfer function k/s + rest; k is 0 without a pole at 0."""
    below = np.array(law.denominator)
    if below[-1] != 0.0 or below.size == 1 or below[-2] == 0.0:
        return 0.0, law
    left = below[:-1]
    k = law.numerator[-1] / left[-1]
    top = np.polysub(np.array(law.numerator), k * left)
    return float(k), Transfer(tuple(top[:-1]), tuple(left))


def _scaled(law: Transfer, time: float, factor: float) -> Transfer:
    """Return a transfer function of s in units of 1/time."""

    def powers(coefficients: tuple[float, ...]) -> FloatArray:
        return np.array(coefficients) * time ** -np.arange(len(coefficients) - 1.0, -1.0, -1.0)

    below = powers(law.denominator)
    above = factor * powers(law.numerator)
    return Transfer(tuple(above / below[0]), tuple(below / below[0]))


def companion(law: Transfer) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return z' = a z + b u, y = c z + d u of a proper transfer function, (k, k), (k,), (k,)."""
    below = np.array(law.denominator) / law.denominator[0]
    above = np.array(law.numerator) / law.denominator[0]
    k = below.size - 1
    above = np.append(np.zeros(k + 1 - above.size), above)
    through = float(above[0])
    a, b = np.eye(k, k, 1), np.zeros(k)
    if k:
        a[-1], b[-1] = -below[:0:-1], 1.0
    return a, b, (above - through * below)[:0:-1], through


@checks_kinds
def driven_plant(rig: StringRig, control: DriveControl, bit: BitRock | None = None) -> Plant:
    """Return the plant of a rig that is turned by a drive under a law.

    Parameters
    ----------
    rig : StringRig
        The string, its bit and rock.
    control : DriveControl
        The drive with its law, which need not be that of the rig.
    bit : BitRock, optional
        The bit–rock law, the paper's without it.

    Returns
    -------
    Plant
        Its loop of the drive is closed; ``drive`` is what comes to the torque of the law.
    """
    machine, time = control.machine, rig.time_scale
    ratio = machine.inertia / rig.inertia
    blocks: list[Block] = [*rig.hoist(), TopDrive(inertia_ratio=ratio)]
    if machine.lag:
        blocks.append(Lagging("drive", machine.lag / time))
    if machine.delay:
        blocks.append(LateInput("drive", machine.delay / time))
    if machine.encoder:
        blocks += [Filtered(name, machine.encoder / time) for name in ("phi", "dphi")]
    blocks.append(DriveLaw(control, time, rig.torsional_stiffness, ratio))
    return paper_plant(bit, PipeString(rig.string), blocks=tuple(blocks))


def asking_plant(rig: StringRig, control: DriveControl, bit: BitRock | None = None) -> Plant:
    """Return the plant of a rig whose drive is free, with what a law asks of it as an output.

    Parameters are those of `driven_plant`. Lag and delay of the machine are not in it: they are
    those of the controller that hands the output ``law`` on to the input ``drive``.
    """
    machine, time = control.machine, rig.time_scale
    ratio = machine.inertia / rig.inertia
    measured = replace(control, machine=replace(machine, lag=0.0, delay=0.0))
    blocks: list[Block] = [*rig.hoist(), TopDrive(inertia_ratio=ratio)]
    if machine.encoder:
        blocks += [Filtered(name, machine.encoder / time) for name in ("phi", "dphi")]
    blocks.append(DriveLaw(measured, time, rig.torsional_stiffness, ratio, acts=False))
    return paper_plant(bit, PipeString(rig.string), blocks=tuple(blocks))
