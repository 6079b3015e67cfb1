"""The drill string as a linear structure M q'' + C q' + K q = f with two ports, bit and top.

The first two coordinates are the bit's, x and θ; the last two the top end's. All are
perturbations of steady drilling, so that damping, which acts on the velocity itself, is that
of the perturbation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import casadi as ca

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds, makes_of_kinds
from drillctrl.drilling.coefficients import Coefficients, Expression
from drillctrl.drilling.part import Part
from drillctrl.drilling.quantities import RATES, checked_quantity

BIT = ("x", "theta")
TOP = ("x_top", "theta_top")


class SideFriction(NamedTuple):
    """Dry friction of a part of the string on the wall, which acts on its rotation.

    Attributes
    ----------
    weights : mapping
        Coordinate → its share in the angle of that part; 1 in all where all turn as one.
    torque, held : expression
        Of friction while it slides, and the most that holds it at rest.
    """

    weights: Mapping[str, Expression]
    torque: Expression
    held: Expression


@makes_of_kinds
@dataclass(frozen=True, eq=False)
class String:
    """A linear structure seen from its two ports.

    Attributes
    ----------
    coordinates : mapping
        Name → ``"length"`` or ``"angle"``, N of them: ``x`` and ``theta`` of the bit first,
        ``x_top`` and ``theta_top`` last.
    mass, damping, stiffness : (N, N)
        M, C and K, as nested lists, arrays or CasADi matrices. The top end has no mass as
        long as its motion is imposed.
    inputs : mapping
        Name → coordinate on which that force or torque acts.
    outputs : mapping
        Name → (quantity, {state: factor}): what is measured beside the states.
    imposed : tuple of str
        Coordinates whose motion is imposed; a drive takes the top end's out.
    reference : mapping
        Coordinate → top coordinate whose imposed motion is taken off when it is measured;
        by default ``x_top`` for lengths, ``theta_top`` for angles; None for none.
    sides : tuple of SideFriction
        Friction on the wall, the first that on the bit's own coordinate. In steady drilling all of
        it slides; it is no part of small motion.

    Raises
    ------
    InputError
        If shapes, names or quantities do not fit.
    """

    coordinates: Mapping[str, str]
    mass: Any
    damping: Any
    stiffness: Any
    inputs: Mapping[str, str] = field(default_factory=lambda: {"axial": "x", "torque": "theta"})
    outputs: Mapping[str, tuple[str, Mapping[str, Expression]]] = field(default_factory=dict)
    imposed: tuple[str, ...] = TOP
    reference: Mapping[str, str | None] = field(default_factory=dict)
    sides: tuple[SideFriction, ...] = ()

    def __post_init__(self) -> None:
        names = tuple(self.coordinates)
        if names[:2] != BIT or (self.imposed == TOP and names[-2:] != TOP):
            wanted = "x and theta first, x_top and theta_top last"
            raise InputError("coordinates", ", ".join(names), wanted)
        for name, quantity in self.coordinates.items():
            if quantity not in RATES:
                raise InputError(f"quantity of {name}", quantity, f"one of {', '.join(RATES)}")
        size = len(names)
        for name in ("mass", "damping", "stiffness"):
            matrix = as_matrix(name, getattr(self, name))
            if matrix.shape != (size, size):
                wanted = f"of shape ({size}, {size})"
                raise InputError(name, f"matrix of shape {matrix.shape}", wanted)
            object.__setattr__(self, name, matrix)
        for name, coordinate in self.inputs.items():
            if coordinate not in names:
                raise InputError(f"input {name}", coordinate, f"one of {', '.join(names)}")
        for name, (quantity, _) in self.outputs.items():
            checked_quantity(name, quantity)


@checks_kinds
def spring_string(
    coordinates: Mapping[str, str],
    masses: Mapping[str, Expression],
    springs: Mapping[tuple[str, str], Expression],
    dampers: Mapping[str | tuple[str, str], Expression],
    **signals: Any,
) -> String:
    """Return a string of masses, springs and dampers.

    Parameters
    ----------
    coordinates : mapping
        As in `String`.
    masses : mapping
        Coordinate → mass or inertia.
    springs : mapping
        Pair of coordinates → stiffness between them.
    dampers : mapping
        Coordinate → damping of its velocity; pair → damping between them.
    **signals
        ``inputs``, ``outputs``, ``imposed`` and ``reference`` of `String`.

    Raises
    ------
    InputError
        If a coordinate is unknown.
    """
    names = list(coordinates)
    matrices = [ca.SX(len(names), len(names)) for _ in range(3)]

    def place(name: str) -> int:
        if name not in names:
            raise InputError("coordinate", name, f"one of {', '.join(names)}")
        return names.index(name)

    all_elements: tuple[Mapping[Any, Expression], ...] = (masses, dampers, springs)
    for matrix, elements in zip(matrices, all_elements, strict=True):
        for ends, value in elements.items():
            where = [place(name) for name in ((ends,) if isinstance(ends, str) else ends)]
            for row, i in enumerate(where):
                for column, j in enumerate(where):
                    matrix[i, j] += value if row == column else -value
    mass, damping, stiffness = matrices
    return String(coordinates, mass, damping, stiffness, **signals)


def as_matrix(name: str, given: Any) -> ca.SX:
    """Return a matrix of numbers and expressions as SX.

    Raises
    ------
    InputError
        If it is none.
    """
    if isinstance(given, ca.SX):
        return given
    if isinstance(given, ca.DM):
        return ca.SX(given)
    try:
        # Entry by entry: NumPy would turn symbols into NaN without a word.
        rows = [[ca.SX(entry) for entry in row] for row in given]
        return ca.sparsify(ca.vertcat(*[ca.horzcat(*row) for row in rows]))
    except (TypeError, NotImplementedError, RuntimeError):
        raise InputError(name, type(given).__name__, "a matrix of numbers") from None


class StringModel(Part):
    """Makes a string from the coefficients and its own parameters.

    Attributes
    ----------
    unused_groups : tuple of str
        Dimensionless groups that do not bear on it, since it says itself what they would.
    """

    unused_groups: ClassVar[tuple[str, ...]] = ()

    def build(self, c: Coefficients, q: Any) -> String:
        """Return the string.

        Parameters
        ----------
        c : Coefficients
            In any consistent units.
        q : record
            The model's own parameters by name.
        """
        raise NotImplementedError(f"{type(self).__name__} must build a string")


class LumpedString(StringModel):
    """One axial and one torsional spring between the top end and the bit (Eq. 1)."""

    def build(self, c: Coefficients, q: Any) -> String:
        """Return the paper's string."""
        return spring_string(
            {"x": "length", "theta": "angle", "x_top": "length", "theta_top": "angle"},
            masses={"x": c.mass, "theta": c.inertia},
            springs={
                ("x", "x_top"): c.axial_stiffness,
                ("theta", "theta_top"): c.torsional_stiffness,
            },
            dampers={"x": c.axial_damping, "theta": c.torsional_damping},
        )


class StringFunction(StringModel):
    """A string from a plain function c → String; workers need one that can be imported."""

    def __init__(self, function: Callable[[Coefficients], String]) -> None:
        super().__init__()
        self.__dict__["function"] = function

    @property
    def form(self) -> Any:
        """The function itself."""
        return StringFunction, self.__dict__["function"]

    def build(self, c: Coefficients, q: Any) -> String:
        """Return what the function says."""
        made = self.__dict__["function"](c)
        if not isinstance(made, String):
            raise InputError("string", type(made).__name__, "a String from the function given")
        return made
