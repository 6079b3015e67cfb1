"""Work at many operating points: side by side, each kept in a checkpoint when it is done."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import fields
from typing import Any, Protocol, TypeVar

from drillctrl.base.checkpoint import Checkpoint
from drillctrl.base.errors import InputError
from drillctrl.base.workers import Progress, spread_out
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import Case
from drillctrl.drilling.point import RigPoint
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.drive_control import law_controller
from drillctrl.spectrum.roots import spectral_abscissa
from drillctrl.strings.changed import string_of
from drillctrl.strings.drive_laws import DriveLaws
from drillctrl.strings.drives import machine_of
from drillctrl.tables.gain_table import GainTable

Closing = Controller | GainTable | DriveLaws | None


class PointTask(Protocol):
    """What is to be done at an operating point."""

    @property
    def index(self) -> int:
        """Its place among the others."""

    @property
    def key(self) -> str:
        """Hash of all that the result depends on; see `task_key`."""


Task = TypeVar("Task", bound=PointTask)


def run_tasks(
    work: Callable[[Task], dict[str, Any]],
    tasks: Sequence[Task],
    executor: Executor | None,
    checkpoint: Checkpoint | None,
    progress: Progress | None,
    stage: str = "simulate",
) -> list[dict[str, Any]]:
    """Return the result of each task, in their order.

    Parameters
    ----------
    work : callable
        Returns a mapping of JSON types with the task's own ``index``.
    tasks : sequence
        With different indices.
    executor, checkpoint, progress
        As in `campaign`.
    stage : str
        Told to ``progress``.
    """
    found: dict[int, dict[str, Any]] = {}
    if checkpoint is not None:
        for task in tasks:
            known = checkpoint.find(task.key)
            if known is not None:
                found[task.index] = {**known, "index": task.index}
    missing = {task.index: task for task in tasks if task.index not in found}
    for entry in spread_out(executor, work, list(missing.values())):
        found[entry["index"]] = entry
        if checkpoint is not None:
            checkpoint.keep(missing[entry["index"]].key, entry)
        if progress is not None:
            progress(stage, len(found) - len(tasks) + len(missing), len(missing))
    return [found[task.index] for task in tasks]


def task_key(case: Case, controller: Controller | None, *settings: Any) -> str:
    """Return a hash of plant, point, controller and whatever else a result depends on."""
    plant, point = case.physics("a study")
    parts: list[Any] = [*settings, plant.text, point]
    if controller is not None:
        feedback = controller.feedback
        assert isinstance(feedback, FeedbackStructure)
        parts += [feedback.inputs, feedback.outputs]
        parts += [array.tolist() for array in controller.gain_sets()]
        parts.append(controller.delays(0.0).tolist())
        own = ("feedback", "K1", "K2", "schedule", "plant")
        parts += [getattr(controller, f.name) for f in fields(controller) if f.name not in own]
    return hashlib.sha256(repr(parts).encode("utf-8")).hexdigest()


def closed_at(
    controller: Closing,
    case: Case,
    where: RigPoint | None = None,
    surroundings: Mapping[str, Any] | None = None,
) -> tuple[Case, Controller | None]:
    """Return plant and controller of a loop at an operating point.

    Parameters
    ----------
    controller : Controller, GainTable, DriveLaws or None
        One everywhere, a table's gains, or the law of a top drive at the string's length.
    case : Case
        What drills, and where.
    where : RigPoint, optional
        The rig behind it, which a law of its drive needs.
    surroundings : mapping, optional
        Further arguments of the `Controller` that is made of a table's gains, or of
        `law_controller`.

    Raises
    ------
    InputError
        If a law has no rig with a top drive to turn.
    """
    if isinstance(controller, DriveLaws):
        plant, _ = case.physics("a law of a top drive")
        if where is None:
            raise InputError("structure", controller.name, "used with a rig: it turns a string")
        machine_of(where.rig)
        law = controller.at(string_of(where.rig).length)
        return law_controller(where, law, plant.bit, **(surroundings or {}))
    if not isinstance(controller, GainTable):
        return case, controller
    K1, K2 = controller.gains_at(*controller.grid.place_of(case))
    plant = controller.grid.plant
    return case, Controller(controller.structure, K1[0], K2[0], plant=plant, **(surroundings or {}))


def linear_abscissa(case: Case, controller: Controller | None) -> float:
    """Return α of the linear loop with an ideal controller."""
    if controller is None:
        return spectral_abscissa(case.system(()))
    feedback = controller.feedback
    assert isinstance(feedback, FeedbackStructure)
    _, point = case.physics("a study")
    loop = close_loop(
        case.system(feedback.inputs), feedback, controller.K1, controller.K2, delay=point.delay
    )
    return spectral_abscissa(loop)
