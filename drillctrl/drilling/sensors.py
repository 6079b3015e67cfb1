"""Sensors and actuators between the plant and its controller, as further states."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca

from drillctrl.base.errors import InputError, checked_number
from drillctrl.drilling.block import Block
from drillctrl.drilling.coefficients import Coefficients
from drillctrl.drilling.quantities import Signal
from drillctrl.drilling.realisation import Late, Realisation


def _index(names: tuple[str, ...], name: str, kind: str) -> int:
    if name not in names:
        raise InputError(kind, name, f"one of {', '.join(names)}")
    return names.index(name)


class Filtered(Block):
    """An output that is measured through a first-order filter, and late if asked.

    T yf'(t) = y(t − delay) − yf(t); the output is called ``NAME_filtered``.

    Parameters
    ----------
    output : str
        Which.
    time_constant : float
        T > 0.
    delay : float
        Age of what enters the filter; 0 for none.

    Raises
    ------
    InputError
        If a number is out of range.
    """

    def __init__(self, output: str, time_constant: float, delay: float = 0.0) -> None:
        names = (f"{output}_filter_time", f"{output}_filter_delay")
        self.__dict__.update(output=output, late=delay > 0.0, _names=names)
        self.__dict__["parameters"] = dict.fromkeys(names[: 2 if delay > 0.0 else 1], 0.0)
        self.__dict__["quantities"] = dict.fromkeys(names, "time")
        values = {names[0]: checked_number("time_constant", time_constant, 0.0, 1e9, open_low=True)}
        if checked_number("delay", delay, 0.0, 1e9) > 0.0:
            values[names[1]] = delay
        super().__init__(**values)

    @property
    def form(self) -> Any:
        """What is filtered, and whether it is late."""
        return Filtered, self.__dict__["output"], self.__dict__["late"]

    def signals(self, made: Realisation, c: Coefficients, q: Any) -> Realisation:
        """Return the equations with the filter's state and output."""
        output, names = self.__dict__["output"], self.__dict__["_names"]
        row = _index(made.output_names, output, "output")
        constant = getattr(q, names[0])
        grown = _grown(made, Signal(f"{output}_filtered", made.outputs[row].quantity))
        n = len(made.states)
        entering = ca.SX(n + 1, n + 1)
        entering[n, :n] = made.C[row, :] / constant
        a, t = grown.A[:, :], grown.T[:, :]
        a[n, n] = -1 / constant
        t[n, :] = -made.R[row, :] / constant
        late = grown.late
        if self.__dict__["late"]:
            late = (*late, Late(getattr(q, names[1]), entering))
        else:
            a = a + entering
        measured = ca.SX(1, n + 1)
        measured[0, n] = 1
        return replace(grown, A=a, T=t, late=late).with_output(
            grown.states[-1], measured, ca.SX(1, 4)
        )


class Lagging(Block):
    """An input that acts through a first-order lag: T a' = u − a, and a is what acts.

    Parameters
    ----------
    input : str
        Which.
    time_constant : float
        T > 0.

    Raises
    ------
    InputError
        If T is out of range.
    """

    def __init__(self, input: str, time_constant: float) -> None:
        name = f"{input}_lag"
        self.__dict__.update(input=input, parameters={name: 0.0}, quantities={name: "time"})
        super().__init__(
            **{name: checked_number("time_constant", time_constant, 0.0, 1e9, open_low=True)}
        )

    @property
    def form(self) -> Any:
        """What lags."""
        return Lagging, self.__dict__["input"]

    def signals(self, made: Realisation, c: Coefficients, q: Any) -> Realisation:
        """Return the equations with the actuator's state."""
        name = self.__dict__["input"]
        column = _index(made.input_names, name, "input")
        constant = getattr(q, f"{name}_lag")
        grown = _grown(made, Signal(f"{name}_acting", made.inputs[column].quantity))
        n = len(made.states)
        a, b = grown.A[:, :], grown.B[:, :]
        a[:n, n] = made.B[:, column]
        a[n, n] = -1 / constant
        b[:, column] = 0
        b[n, column] = 1 / constant
        measured = ca.SX(1, n + 1)
        measured[0, n] = 1
        return replace(grown, A=a, B=b).with_output(grown.states[-1], measured, ca.SX(1, 4))


class LateInput(Block):
    """An input that acts late: what a controller asks for is there a delay later.

    Parameters
    ----------
    input : str
        Which.
    delay : float
        At least 0.

    Raises
    ------
    InputError
        If the delay is out of range.
    """

    def __init__(self, input: str, delay: float) -> None:
        name = f"{input}_delay"
        self.__dict__.update(input=input, parameters={name: 0.0}, quantities={name: "time"})
        super().__init__(**{name: checked_number("delay", delay, 0.0, 1e9)})

    @property
    def form(self) -> Any:
        """What is late."""
        return LateInput, self.__dict__["input"]

    def signals(self, made: Realisation, c: Coefficients, q: Any) -> Realisation:
        """Return the equations with the input's delay."""
        name = self.__dict__["input"]
        _index(made.input_names, name, "input")
        later = made.input_delays.get(name, 0.0) + getattr(q, f"{name}_delay")
        return replace(made, input_delays={**made.input_delays, name: later})


def _grown(made: Realisation, state: Signal) -> Realisation:
    """Return a realisation with one more state that nothing moves yet."""
    n = len(made.states)

    def taller(matrix: ca.SX) -> ca.SX:
        return ca.vertcat(matrix, ca.SX(1, matrix.shape[1]))

    def bigger(matrix: ca.SX) -> ca.SX:
        return ca.horzcat(taller(matrix), ca.SX(n + 1, 1))

    return replace(
        made,
        states=(*made.states, state),
        A=bigger(made.A),
        E=taller(made.E),
        B=taller(made.B),
        T=taller(made.T),
        C=ca.horzcat(made.C, ca.SX(made.C.shape[0], 1)),
        late=tuple(Late(delay, bigger(matrix)) for delay, matrix in made.late),
    )
