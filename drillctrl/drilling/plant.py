"""The plant: a string, its blocks and a bit–rock law, composed as CasADi expressions."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, TypeVar

import casadi as ca
import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds, makes_of_kinds
from drillctrl.drilling.bit_rock import BitRock, PaperLaw
from drillctrl.drilling.block import Block
from drillctrl.drilling.coefficients import (
    GROUP_NAMES,
    RIG_PARAMETER_NAMES,
    Coefficients,
    dimensionless_coefficients,
    rig_coefficients,
)
from drillctrl.drilling.drive import TopDrive
from drillctrl.drilling.part import Part
from drillctrl.drilling.realisation import Realisation, realise
from drillctrl.drilling.string import LumpedString, String, StringFunction, StringModel

R = TypeVar("R")


@makes_of_kinds
@dataclass(frozen=True)
class Plant:
    """What drills: a linear structure with a bit in the rock.

    Plants with equal parts are equal; those of one form share what is derived for them.

    Attributes
    ----------
    bit : BitRock
        The bit–rock law.
    string : StringModel
        What hangs between top end and bit.
    blocks : tuple of Block
        Drives, sensors and actuators, in the order in which they are composed.
    group_names : tuple of str
        Parameters that `coefficients` takes.
    coefficients : callable
        From a record of these to `Coefficients`.

    Raises
    ------
    InputError
        If a parameter's name is used twice.
    """

    bit: BitRock
    string: StringModel
    blocks: tuple[Block, ...] = ()
    group_names: tuple[str, ...] = GROUP_NAMES
    coefficients: Callable[[Any], Coefficients] = dimensionless_coefficients

    def __post_init__(self) -> None:
        names = self.parameter_names
        twice = [name for i, name in enumerate(names) if name in names[:i]]
        if twice:
            raise InputError("parameter", twice[0], "a name that is used once in a plant")

    @property
    def parts(self) -> tuple[Part, ...]:
        """Law, string and blocks."""
        return (self.bit, self.string, *self.blocks)

    @property
    def own(self) -> dict[str, float]:
        """Parameters of the parts, by name."""
        return {name: value for part in self.parts for name, value in part.values.items()}

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """All parameters: the groups, then those of the parts."""
        return (*self.group_names, *(name for part in self.parts for name in part.values))

    @functools.cached_property
    def form(self) -> Hashable:
        """What the plant is apart from the values of its parts."""
        return (tuple(part.form for part in self.parts), self.group_names, self.coefficients)

    @property
    def text(self) -> str:
        """What the plant consists of, in one line; the same for equal plants in every process."""
        own = f"{self.coefficients.__module__}.{self.coefficients.__qualname__}"
        return "; ".join([*(part.text for part in self.parts), own])

    def with_values(self, **changes: float) -> Plant:
        """Return the plant with other values of its parts' parameters.

        Raises
        ------
        InputError
            If no part has such a parameter.
        """
        for name in changes:
            if name not in self.own:
                known = ", ".join(self.own) or "none: its parts have no parameters"
                raise InputError("parameter", name, f"one of {known}")

        def changed(part: Any) -> Any:
            mine = {name: value for name, value in changes.items() if name in part.values}
            return part.with_values(**mine) if mine else part

        return replace(
            self,
            bit=changed(self.bit),
            string=changed(self.string),
            blocks=tuple(changed(block) for block in self.blocks),
        )

    @property
    def linear(self) -> Realisation:
        """The linear structure, as expressions in the parameters."""
        return expressions(self).structure

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states; the bit's x, dx, theta and dtheta come first."""
        return self.linear.state_names

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return self.linear.input_names

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the outputs; all states are among them."""
        return self.linear.output_names

    def quantity(self, name: str) -> str:
        """Return what an input or an output measures, a key of `SI_UNITS`.

        Raises
        ------
        InputError
            If there is no such signal.
        """
        known = {signal.name: signal.quantity for signal in
                 (*self.linear.outputs, *self.linear.inputs)}  # fmt: skip
        if name not in known:
            raise InputError("signal", name, f"one of {', '.join(known)}")
        return known[name]


@dataclass(frozen=True, eq=False)
class Expressions:
    """A plant's form in symbols.

    Attributes
    ----------
    parameters : SX, (k, 1)
        All parameters, in the order of `Plant.parameter_names`.
    c : Coefficients
        From the groups.
    q : record
        The law's own parameters by name.
    bit : BitRock
        The law.
    structure : Realisation
        The linear structure.
    """

    parameters: ca.SX
    c: Coefficients
    q: Any
    bit: BitRock
    structure: Realisation


@dataclass(frozen=True)
class _Form:
    """A key that carries a plant of that form."""

    key: Hashable
    plant: Plant = field(compare=False)


def by_form(function: Callable[[Plant], R]) -> Callable[[Plant], R]:
    """Remember what a function says of a plant for all plants of its form."""

    @functools.lru_cache(maxsize=256)
    def remembered(form: _Form) -> R:
        return function(form.plant)

    @functools.wraps(function)
    def wrapped(plant: Plant) -> R:
        return remembered(_Form(plant.form, plant))

    return wrapped


@by_form
def expressions(plant: Plant) -> Expressions:
    """Return the plant in symbols."""
    symbols = {name: ca.SX.sym(name) for name in plant.parameter_names}
    c = plant.coefficients(SimpleNamespace(**{n: symbols[n] for n in plant.group_names}))

    def record(part: Part) -> Any:
        return SimpleNamespace(**{name: symbols[name] for name in part.values})

    string = plant.string.build(c, record(plant.string))
    for block in plant.blocks:
        string = block.mechanics(string, c, record(block))
    structure = realise(string)
    for block in plant.blocks:
        structure = block.signals(structure, c, record(block))
    vector = ca.vertcat(*symbols.values())
    return Expressions(vector, c, record(plant.bit), plant.bit, structure)


Evaluator = Callable[[FloatArray], list[FloatArray]]


def evaluator(form: Expressions, outputs: Sequence[Any]) -> Evaluator:
    """Compile expressions: rows of parameters, (N, k) → the value of each, (N, rows, columns).

    They are evaluated in one column, which costs less than many small matrices.
    """
    parts = [ca.densify(ca.SX(part)) for part in outputs]
    column = ca.vertcat(*[ca.vec(part.T) for part in parts])
    function = ca.Function("column", [form.parameters], [column])
    ends = np.cumsum([0, *(part.numel() for part in parts)]).tolist()
    places = [(slice(*pair), part.shape) for pair, part in zip(pairwise(ends), parts, strict=True)]

    def evaluate(rows: FloatArray) -> list[FloatArray]:
        mapped = function if len(rows) == 1 else function.map(len(rows))
        # Numbers go in and out where they lie: CasADi's own arrays come as lists of Python's.
        given, values = np.ascontiguousarray(rows, dtype=float), np.empty((len(rows), ends[-1]))
        buffer, run = mapped.buffer()
        # Their size is read off the memory, whatever CasADi's annotations say.
        buffer.set_arg(0, given.data)  # type: ignore[call-arg]
        buffer.set_res(0, values.data)  # type: ignore[call-arg]
        run()
        return [values[:, place].reshape(len(rows), *shape) for place, shape in places]

    return evaluate


@checks_kinds
def paper_plant(
    bit: BitRock | None = None,
    string: StringModel | Callable[[Coefficients], String] | None = None,
    blocks: tuple[Block, ...] = (),
) -> Plant:
    """Return the dimensionless plant of the paper, or one with some of its parts replaced.

    Parameters
    ----------
    bit : BitRock, optional
        Another bit–rock law.
    string : StringModel or function from Coefficients to String, optional
        Another string.
    blocks : tuple of Block
        Drive, sensors and actuators.

    Raises
    ------
    InputError
        If a part is of another kind.
    """
    if bit is None and string is None and not blocks:
        return _paper()
    law = PaperLaw() if bit is None else bit
    if string is None:
        string = LumpedString()
    elif callable(string) and not isinstance(string, StringModel):
        string = StringFunction(string)
    blocks = (blocks,) if isinstance(blocks, Block) else tuple(blocks)
    for name, part, kind in (
        ("bit", law, BitRock),
        ("string", string, StringModel),
        *(("blocks", block, Block) for block in blocks),
    ):
        if not isinstance(part, kind):
            raise InputError(name, type(part).__name__, f"a {kind.__name__}")
    groups = tuple(name for name in GROUP_NAMES if name not in string.unused_groups)
    return Plant(law, string, blocks, groups)


@functools.cache
def _paper() -> Plant:
    """Return the paper's plant, which most calls are about: what is derived of it is kept."""
    return Plant(PaperLaw(), LumpedString(), ())


def rig_plant() -> Plant:
    """Return the paper's plant in SI, parameters in the order of `RIG_PARAMETER_NAMES`."""
    return Plant(PaperLaw(), LumpedString(), (), RIG_PARAMETER_NAMES, rig_coefficients)


@checks_kinds
def top_drive_plant(inertia_ratio: float) -> Plant:
    """Return the dimensionless plant with a top drive.

    Parameters
    ----------
    inertia_ratio : float
        J > 0, inertia of the drive, referred to the string, over that at the bit.

    Returns
    -------
    Plant
        States x, dx, theta, dtheta, phi, dphi; inputs axial, torque and ``drive``, the
        perturbation of the drive's torque in units of Kt:
        θ'' gains the term φ, and J φ'' = θ − φ + drive.

    Raises
    ------
    InputError
        If the ratio is not positive.
    """
    return paper_plant(blocks=(TopDrive(inertia_ratio=inertia_ratio),))
