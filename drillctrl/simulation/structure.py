"""A plant as the integrator takes it: arrays of the string, and source of the law of its bit."""

from __future__ import annotations

import functools
from collections.abc import Hashable
from dataclasses import dataclass, field

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.drilling.bit_rock import BitRock, steady_delay, steady_depth
from drillctrl.drilling.case import Case
from drillctrl.drilling.coefficients import Coefficients
from drillctrl.drilling.motion import (
    BIT_COEFFICIENTS,
    MotionArrays,
    kicked_states,
    load_function,
    rest_states,
    stuck_states,
)
from drillctrl.simulation.translate import translate


@dataclass(frozen=True, eq=False)
class Structure:
    """A linear string whose bit meets the rock: X' = A X + E (load − steady) + B u + T top.

    Attributes
    ----------
    state_names, input_names, output_names : tuple of str
        Of X, which begins with x, x', θ, θ' of the bit; of u; and of C X − R top.
    arrays : MotionArrays
        Of the string and of its linear motion, and the parameters of the law.
    law : str
        Source of the function of the bit's loads, which is compiled.
    """

    state_names: tuple[str, ...]
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    arrays: MotionArrays
    law: str

    @property
    def _c(self) -> Coefficients:
        return Coefficients(*self.arrays.q[: len(Coefficients._fields)].tolist())

    @property
    def bit(self) -> tuple[float, ...]:
        """Ω0, V0 and n."""
        return tuple(getattr(self._c, name) for name in BIT_COEFFICIENTS)

    @property
    def omega0(self) -> float:
        """Ω0."""
        return float(self._c.rotary_speed)

    @property
    def penetration_rate(self) -> float:
        """V0."""
        return float(self._c.penetration_rate)

    @property
    def delay(self) -> float:
        """τ0 (Eq. 18)."""
        return float(steady_delay(self._c))

    @property
    def steady_depth(self) -> float:
        """Depth of cut in steady drilling (Eq. 11)."""
        return float(steady_depth(self._c))

    def is_same(self, other: Structure) -> bool:
        """Whether another string and law move alike."""
        names = ("q", "A", "E", "B", "T", "side_force", "side_rate", "side_torque", "side_held")
        # Coefficients that a string has no use for are NaN.
        return self.law == other.law and all(
            np.array_equal(getattr(self.arrays, name), getattr(other.arrays, name), equal_nan=True)
            for name in names
        )

    @functools.cached_property
    def rest(self) -> tuple[FloatArray, FloatArray]:
        """States of a string at rest without load, before and after its top sets off, (n,) each."""
        return rest_states(self.arrays, self.state_names)

    def stuck(self, time: float) -> tuple[FloatArray, FloatArray]:
        """States of a string whose bit stands still: at first, and so long after, (n,) each."""
        return stuck_states(self.arrays, time)

    def kicked(self, axial: float, rotary: float) -> FloatArray:
        """What a bit that moves faster by so much adds to the states, its string with it, (n,)."""
        return kicked_states(self.arrays, self.state_names, axial, rotary)


@dataclass(frozen=True)
class _Form:
    """A key that carries a law of that form."""

    form: Hashable
    law: BitRock = field(compare=False)


@functools.lru_cache(maxsize=64)
def _source(key: _Form) -> str:
    return translate(load_function(key.law))


def structure_of(case: Case) -> Structure:
    """Return what the integrator takes of a case.

    Raises
    ------
    InputError
        If there is no plant, or a signal of it arrives late.
    """
    plant, _ = case.physics("a simulation")
    arrays = case.motion()
    late = [delay for delay in (*arrays.input_delays, *(term[0] for term in arrays.late)) if delay]
    if late:
        delay = f"a signal that arrives {late[0]:g} late"
        raise InputError("plant", delay, "one without; give the controller the delay")
    return Structure(
        plant.state_names,
        plant.input_names,
        plant.output_names,
        arrays,
        _source(_Form(plant.bit.form, plant.bit)),
    )
