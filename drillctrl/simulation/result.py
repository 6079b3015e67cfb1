"""What a simulation returns: its trace, what it was asked for, and what follows from both."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.errors import InputError
from drillctrl.base.extras import required
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.gain_units import control_text
from drillctrl.drilling.rig import Rig
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.past import Past, past_of
from drillctrl.simulation.rig_units import RigMotion, in_rig_units
from drillctrl.simulation.rock_face import RockFace, rock_face
from drillctrl.simulation.scenario import Scenario
from drillctrl.simulation.summary import Summary, summarise
from drillctrl.simulation.trace import Trace
from drillctrl.strings.drive_law import LAW

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# Errors of single steps add up.
_RESOLVED = 100.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Simulation(Trace):
    """A finished run: its trace, and what it was asked for.

    Attributes
    ----------
    controller : Controller or None
    scenario : Scenario
    backwards : str
        What becomes of a bit that turns back, as given to `simulate`.
    rtol, atol : float
        Tolerances of a step.
    rejected, evaluations : int
        Steps that were repeated; evaluations of the right-hand side.
    unsettled : int
        Steps whose friction along the string was not found: its parts did not come to agree with
        one another in 200 sweeps, and the last sweep was taken.
    rig : Rig or None
        Where the run was of a `RigPoint`.
    """

    made_by = "simulate returns"

    controller: Controller | None
    scenario: Scenario
    backwards: str
    rtol: float
    atol: float
    rejected: int
    evaluations: int
    unsettled: int = 0
    rig: Rig | None = field(default=None, repr=False)

    @property
    def resolved(self) -> float:
        """Amplitude of x and θ below which the motion is error of the integration."""
        return _RESOLVED * self.atol

    def in_rig_units(self, times: npt.ArrayLike | None = None) -> RigMotion:
        """Return the motion of a rig in SI units.

        Parameters
        ----------
        times : array_like, optional
            In seconds; by default the integrator's own steps.

        Raises
        ------
        InputError
            If an instant is outside the run, or the run was not of a `RigPoint`.
        """
        if self.rig is None:
            raise InputError("point", repr(self.point), "a RigPoint, for results in rig units")
        unit = self.rig.time_scale
        motion = self.motion if times is None else self.at(np.asarray(times, dtype=float) / unit)
        return in_rig_units(motion, self.point, self.rig)

    def rock_face(self, time: float, count: int = 181) -> RockFace:
        """Return the rock ahead of a blade at an instant; see `simulation.rock_face`."""
        return rock_face(self, time, count)

    def past(self, time: float | None = None, *, kept: float | None = None) -> Past:
        """Return what the run has left behind at an instant, to start another one from.

        Parameters
        ----------
        time : float, optional
            By default the end of the run.
        kept : float, optional
            So much time before it is kept, and what the faces in the rock need, so that a
            chain of runs takes no more and more memory; by default all.

        Raises
        ------
        InputError
            If the instant is outside the run, or the rig was changed before it.
        """
        changes, start = self.scenario.changes, self.scenario.start
        known = start.known if isinstance(start, Past) else math.inf
        return past_of(self, time, changes[0].time if changes else None, kept, known)

    @functools.cached_property
    def summary(self) -> Summary:
        """Figures of the motion over the last quarter of the run."""
        return summarise(self, self.resolved)

    def title(self, name: str | None = None) -> str:
        """Return what a figure is headed by: model, rig, place and controller.

        Parameters
        ----------
        name : str, optional
            Of the rig.
        """
        from drillctrl.simulation.figure import title_of

        return title_of(self, name, self._control_text())

    def _control_text(self) -> str | None:
        """Say what closes the loop, with its first gains."""
        if self.controller is None:
            return "without control"
        feedback = self.controller.feedback
        assert isinstance(feedback, FeedbackStructure)
        if feedback.outputs == (LAW,):
            # Its gains are in the plant.
            return f"top drive: {feedback.name}"
        _, K1, K2 = self.controller.gain_sets()
        plant, _ = self.case.physics("a simulation")
        later = ", later others" if len(K1) > 1 else ""
        return (
            control_text(feedback, K1[0], K2[0], plant, self.case.told_rig, self.case.language)
            + later
        )

    def plot(self, name: str | None = None) -> Figure:
        """Draw axial motion, bit speed and control over time; see `plot_motion`.

        Parameters
        ----------
        name : str, optional
            Of the rig, for the title.
        """
        from drillctrl.simulation.figure import plot_motion

        inputs = () if self.controller is None else self.controller.feedback.inputs  # type: ignore[union-attr]
        return plot_motion(self, inputs, self.title(name))

    def to_control(self) -> Any:
        """Return the motion as a python-control ``TimeResponseData``."""
        control = required("control", "control")

        motion = self.motion
        states, inputs = (
            [getattr(motion, name) for name in names]
            for names in (self.state_names, self.input_names)
        )
        return control.TimeResponseData(
            motion.times,
            np.stack(states),
            inputs=np.stack(inputs),
            issiso=False,
            output_labels=list(self.state_names),
            input_labels=list(self.input_names),
            sysname="drill_string",
        )
