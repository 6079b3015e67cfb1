"""The one door to every verb: a plant, where it drills, and the rig behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.language import DIMENSIONLESS, Language
from drillctrl.delay.system import DelaySystem
from drillctrl.drilling.linear import LinearArrays, linear_arrays
from drillctrl.drilling.motion import MotionArrays, motion_arrays
from drillctrl.drilling.plant import Plant, paper_plant
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.rig import Rig

_KINDS = "an OperatingPoint, a RigPoint, a DelaySystem or a Case"


@dataclass(frozen=True)
class Case:
    """What a verb is asked about.

    Attributes
    ----------
    plant : Plant or None
        The physics; None where only a linear system is known.
    point : OperatingPoint or None
        Where it drills, if it does.
    rig_point : RigPoint or None
        The rig behind the point, if one was given.
    linear : DelaySystem or None
        The system itself, where there is no plant.
    """

    plant: Plant | None
    point: OperatingPoint | None
    rig_point: RigPoint | None = None
    linear: DelaySystem | None = None

    def __post_init__(self) -> None:
        if (self.plant is None) != (self.point is None):
            raise InputError("case", "a plant or a point alone", "both, or a DelaySystem")
        if (self.plant is None) == (self.linear is None):
            raise InputError("case", "a plant and a DelaySystem", "one of them")

    @property
    def rig(self) -> Rig | None:
        """The rig, if one was given."""
        return None if self.rig_point is None else self.rig_point.rig

    @property
    def language(self) -> Language:
        """In which people are told results."""
        return DIMENSIONLESS if self.rig_point is None else self.rig_point.language

    @property
    def told_point(self) -> RigPoint | None:
        """The rig and its point in whose units results are told; None where they have none."""
        return None if self.language is DIMENSIONLESS else self.rig_point

    @property
    def told_rig(self) -> Rig | None:
        """The rig in whose units results are told; None where they have none."""
        return None if self.told_point is None else self.told_point.rig

    @property
    def place(self) -> str:
        """Where it drills, for titles: in the units of its rig where there is one."""
        if (told := self.told_point) is not None:
            speed = self.language.text("angular_rate", told.rotary_speed)
            rate = self.language.text("axial_rate", told.penetration_rate)
            rock = f"rock of {self.language.text('stress', told.rig.rock_strength)}"
            depth = told.rig.depth
            string = [] if depth is None else [f"{self.language.text('depth', depth)} of string"]
            return ", ".join([speed, rate, rock, *string])
        p = self.point
        return "" if p is None else f"ω0 = {p.omega0:g}, δ0 = {p.delta0:g}, ψ = {p.psi:g}"

    @property
    def drills(self) -> bool:
        """Whether the physics is known, not a linear system alone."""
        return self.plant is not None

    def physics(self, verb: str) -> tuple[Plant, OperatingPoint]:
        """Return plant and point.

        Raises
        ------
        InputError
            If there are none; the message names what needs them.
        """
        if self.plant is None or self.point is None:
            wanted = f"an OperatingPoint, a RigPoint or a Case: {verb} needs the physics"
            raise InputError("point", "DelaySystem", wanted)
        return self.plant, self.point

    @property
    def parameters(self) -> dict[str, float]:
        """All parameters of the plant by name: the groups, then those of its parts.

        Raises
        ------
        InputError
            If there is no plant.
        """
        plant, point = self.physics("a parameter")
        groups = {name: float(getattr(point, name)) for name in plant.group_names}
        return {**groups, **plant.own}

    @property
    def parameter_vector(self) -> FloatArray:
        """Values of `parameters`, (k,)."""
        return np.array(list(self.parameters.values()), dtype=float)

    def with_changes(self, **changes: float) -> Case:
        """Return the case with other groups or other parameters of its parts.

        λ keeps its ratio to ψ. The rig goes along as far as groups allow: it is dropped where
        a group changes.

        Raises
        ------
        InputError
            If there is no such parameter, or a value is out of its range.
        """
        plant, point = self.physics("a change of parameters")
        own = {name: value for name, value in changes.items() if name in plant.own}
        groups = {name: value for name, value in changes.items() if name not in plant.own}
        for name in groups:
            if name not in plant.group_names:
                known = ", ".join(plant.parameter_names)
                raise InputError("parameter", name, f"one of {known}")
        if groups:
            point = point.with_changes(**groups)
        rig_point = None if groups else self.rig_point
        return replace(self, plant=plant.with_values(**own), point=point, rig_point=rig_point)

    def at(self, point: OperatingPoint | RigPoint) -> Case:
        """Return the same plant at another point."""
        plant, _ = self.physics("another point")
        return as_case(point, plant)

    def system(self, inputs: Sequence[str] | None = None) -> DelaySystem:
        """Return the linear delayed system (Eqs. 23, 25, 26, 34, 35).

        Parameters
        ----------
        inputs : sequence of str, optional
            Those that are driven; all of them without it.

        Raises
        ------
        InputError
            If there is no such input.
        """
        if self.linear is not None:
            return self.linear
        plant, _ = self.physics("a linear system")
        chosen = plant.input_names if inputs is None else tuple(inputs)
        columns = [_input(plant, name) for name in chosen]
        values = linear_arrays(plant, self.parameter_vector[None, :])
        terms = [(float(values.delay[0]), values.left[0] @ values.right[0])]
        terms += [(float(delay[0]), matrix[0]) for delay, matrix in values.late]
        terms.sort(key=lambda term: term[0])
        return DelaySystem(
            values.A0[0],
            tuple(matrix for _, matrix in terms),
            tuple(delay for delay, _ in terms),
            values.B[0][:, columns],
            values.C[0],
            state_names=plant.state_names,
            input_names=chosen,
            output_names=plant.output_names,
            input_delays=tuple(values.input_delays[0, columns].tolist()),
            feedback_delay=float(values.delay[0]),
        )

    def table(self, values: Mapping[str, npt.ArrayLike], count: int) -> FloatArray:
        """Return rows of parameters in which some vary, (count, k).

        λ keeps its ratio to ψ unless it varies itself; ``damping`` is ξ and κ together.

        Parameters
        ----------
        values : mapping
            Parameter → value of each row, (count,) or one for all.
        count : int
            Number of rows.
        """
        names = list(self.parameters)
        rows = np.tile(self.parameter_vector, (count, 1))
        for name, column in values.items():
            for target in ("xi", "kappa") if name == "damping" else (name,):
                if target not in names:
                    raise InputError("parameter", target, f"one of {', '.join(names)}")
                rows[:, names.index(target)] = column
        _, point = self.physics("a table of parameters")
        if "psi" in values and "lam" not in values and point.psi > 0.0:
            ratio = float(point.lam or 0.0) / point.psi
            rows[:, names.index("lam")] = ratio * rows[:, names.index("psi")]
        return rows

    def linear_arrays(self, rows: FloatArray) -> LinearArrays:
        """Return the linear plants at rows of `table`."""
        return linear_arrays(self.physics("a table of systems")[0], rows)

    def motion(self) -> MotionArrays:
        """Return what the integrator takes."""
        return motion_arrays(self.physics("a simulation")[0], self.parameter_vector)


def _input(plant: Plant, name: str) -> int:
    if name not in plant.input_names:
        raise InputError("inputs", name, f"among {', '.join(plant.input_names)}")
    return plant.input_names.index(name)


Where = OperatingPoint | RigPoint | DelaySystem | Case


@checks_kinds
def as_case(where: Where, plant: Plant | None = None) -> Case:
    """Return a case from whatever a verb was given.

    Parameters
    ----------
    where : OperatingPoint, RigPoint, DelaySystem or Case
        A point without a plant is the paper's, with the string that its rig may have.
    plant : Plant, optional
        The physics at a point.

    Raises
    ------
    InputError
        If it is something else, or a plant is given beside a DelaySystem.
    """
    if plant is not None and not isinstance(plant, Plant):
        raise InputError("plant", type(plant).__name__, "a Plant")
    if isinstance(where, Case):
        if plant is None:
            return where
        _, point = where.physics("another plant")
        return Case(plant, point, where.rig_point)
    if isinstance(where, DelaySystem):
        if plant is not None:
            raise InputError("plant", "given", "left out beside a DelaySystem")
        return Case(None, None, None, where)
    if isinstance(where, RigPoint):
        drilled = paper_plant(**where.rig.hardware()) if plant is None else plant
        return Case(drilled, where.operating_point(), where)
    if isinstance(where, OperatingPoint):
        return Case(paper_plant() if plant is None else plant, where)
    raise InputError("point", type(where).__name__, _KINDS)


@checks_kinds
def plant_system(where: Where, inputs: Sequence[str] | None = ("torque",)) -> DelaySystem:
    """Return the linear delayed system of a case (Eqs. 23, 25, 26, 34, 35).

    Parameters
    ----------
    where : OperatingPoint, RigPoint, DelaySystem or Case
        What drills, and where.
    inputs : sequence of str, optional
        Which of the plant's inputs are driven: ``"torque"`` (the paper's u), ``"axial"``, and
        those of its blocks; None for all.

    Returns
    -------
    DelaySystem
        All states are outputs.
    """
    return as_case(where).system(inputs)
