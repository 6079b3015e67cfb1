"""The torque with which a bit on its axial orbit answers a change of its speed."""

from __future__ import annotations

import inspect
import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from drillctrl.base.arrays import ComplexArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.shelf import Shelf
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.drilling.plant import Plant
from drillctrl.motion.record import Halves, halves, windowed
from drillctrl.motion.turning import Led, Turned
from drillctrl.simulation.outcome import grows_without_bound
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Scenario
from drillctrl.simulation.status import Outcome, Status

# H is told to this, in units of sqrt(I Kt), unless it takes too long.
TOLERANCE = 3e-3
# Dimensionless: what is slower takes more than 1e6 units of time, what is faster no steps.
FREQUENCIES = (1e-4, 1e3)
MOST_PERIODS, FEWEST_PERIODS = 400, 40
# Axial kicks, over the rate of penetration, from which the orbit is reached: out of smooth
# drilling, and off the rock.
KICKS = (0.1, -2.0)
# Periods of a half window. Half windows of a run that is gone on from, an even number; fewer
# of a long string, whose history takes much memory, and in longer steps.
_PERIODS, _PER_RUN, _PER_LONG_RUN, _LONG = 4, 10, 2, 20
_LONG_RTOL = 1e-6
_SETTLING = 10.0
_SHORTEST, _LONGEST = 60.0, 500.0
_SURE = 2.0
# Swing of the speed beside the one that is imposed, beyond which that is not what the bit does.
_OWN = 0.5


@dataclass(frozen=True, eq=False)
class BitResponse:
    """The answer of a bit to Ω = Ω0 (1 + A cos ωt).

    Attributes
    ----------
    frequency : float
        ω.
    amplitude : float
        A, share of the rotary speed, as it came out.
    value : complex
        H, amplitude of the torque on bit over that of the speed; a positive real part damps.
        NaN where a run broke off. At −ω it is the conjugate.
    error : float
        Of the modulus of H: twice the standard error of the mean over windows, or half the
        difference of the two starts where that is more; infinite where a run broke off, or the
        bit swings of itself by half of its speed.
    windows : complex array, (w,)
        H in each window, those of one start after those of the other.
    starts : complex array, (2,)
        Means of each start. Where they differ by more than the scatter, there are two orbits.
    weight, torque : float
        Means of the loads on the bit.
    held, lifted : float
        Shares of the time: held at Z' = 0, and off the rock.
    periods : int
        Of ω, that were looked at.
    ripple : bool
        Whether the speed could ripple beside the swing.
    rippled : float
        By how much it did: (max − min)/(2 Ω0), less A.
    broken : Status, Outcome or None
        Why a run broke off: its status, or that the bit bounces without bound, for which an
        imposed rotation has power enough.
    """

    frequency: float
    amplitude: float
    value: complex
    error: float
    windows: ComplexArray = field(repr=False)
    starts: ComplexArray = field(repr=False)
    weight: float
    torque: float
    held: float
    lifted: float
    periods: int
    ripple: bool = False
    rippled: float = 0.0
    broken: Status | Outcome | None = None

    @property
    def scatter(self) -> float:
        """Largest distance of H in a window from its mean; infinite where there is none."""
        if self.broken is not None:
            return math.inf
        return float(np.abs(self.windows - self.value).max())


_CLASSES: dict[str, type[Any]] = {each.__name__: each for each in (BitResponse, Status, Outcome)}


def turned_case(where: Where, frequency: float, ripple: bool = False) -> Case:
    """Return the motion of a case under a rotation that swings at a frequency.

    It is imposed, and θ' at t = 0 sets it; or led, with ripple, and θ' of ``lead`` does.

    Raises
    ------
    InputError
        If there is no plant, or nothing is cut.
    """
    case = as_case(where)
    plant, point = case.physics("the response of a bit")
    if not point.delta0 > 0.0:
        raise InputError("delta0", point.delta0, "above 0: a bit that cuts nothing has no orbit")
    turning = Led(lead_frequency=frequency) if ripple else Turned(turning_frequency=frequency)
    return Case(replace(plant, blocks=(*plant.blocks, turning)), point)


def settling_time(case: Case) -> float:
    """Return how long the axial orbit is waited for, by the damping of the string alone."""
    axial = [0, 1, *range(4, case.motion().A.shape[0])]
    slowest = -float(np.linalg.eigvals(case.motion().A[np.ix_(axial, axial)]).real.max())
    return float(np.clip(_SETTLING / max(slowest, 1e-9), _SHORTEST, _LONGEST))


@checks_kinds
def bit_response(
    where: Where,
    frequency: float,
    amplitude: float,
    *,
    tolerance: float = TOLERANCE,
    most_periods: int = MOST_PERIODS,
    ripple: bool = False,
    keep: str | Path | None = None,
    **options: Any,
) -> BitResponse:
    """Return the response H(iω, A) of a bit on its axial orbit.

    The bit is turned at Ω0 (1 + A cos ωt), whatever the rock bears; only the axial motion is
    simulated. When it has reached its orbit, the part of the torque at ω is taken over
    windows of eight periods, from two starts.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or Case
        What drills, and where.
    frequency : float
        ω in `FREQUENCIES`, dimensionless.
    amplitude : float
        A in (0, 1): the bit does not turn back.
    tolerance : float
        Error of H at which no more windows are looked at, in units of the torque per speed.
    most_periods : int
        So many periods of ω of each start are looked at where the error stays larger.
    ripple : bool
        Whether the speed is imposed at ω alone, so that the torque of the orbit makes it
        ripple at all other frequencies, as far as the torsional string lets it; else the
        rotation is imposed whole. With ripple A comes out a few per cent off what was asked.
    keep : str or Path, optional
        A folder in which responses are kept by what computed them: the plant, the point, these
        arguments, the package's sources and its libraries. What is there is not computed again.
    **options
        ``cutting``, ``rtol`` and others of `simulate`.

    Returns
    -------
    BitResponse
        In dimensionless units.

    Raises
    ------
    InputError
        If an argument is out of its range, there is no plant, or its axial and torsional
        motion are coupled elsewhere than at the bit.
    """
    frequency = checked_number("frequency", frequency, *FREQUENCIES)
    amplitude = checked_number("amplitude", amplitude, 0.0, 0.999, open_low=True)
    tolerance = checked_number("tolerance", tolerance, 0.0, 1e6, open_low=True)
    most_periods = checked_integer("most_periods", most_periods, FEWEST_PERIODS, 1_000_000)
    case = turned_case(where, frequency, ripple)
    settling = settling_time(turned_case(where, frequency))

    def measured() -> BitResponse:
        return _measured(
            case, settling, frequency, amplitude, tolerance, most_periods, ripple, options
        )

    if keep is None:
        return measured()
    plant, point = case.physics("the response of a bit")
    asked = (frequency, amplitude, tolerance, most_periods, ripple, sorted(options.items()))
    return Shelf(keep, _CLASSES).get((plant.text, _own_sources(plant), point, *asked), measured)


def _own_sources(plant: Plant) -> list[str]:
    """Return the sources of parts that are not the package's, whose names say little of them.

    Raises
    ------
    InputError
        If one cannot be read.
    """
    kinds = [type(part) for part in plant.parts]
    found = []
    for kind in [kind for kind in kinds if not kind.__module__.startswith("drillctrl.")]:
        try:
            found.append(inspect.getsource(kind))
        except (OSError, TypeError):
            wanted = f"left out: the source of {kind.__name__} cannot be read, nor told from others"
            raise InputError("keep", "given", wanted) from None
    return found


def _measured(
    case: Case,
    settling: float,
    frequency: float,
    amplitude: float,
    tolerance: float,
    most_periods: int,
    ripple: bool,
    options: dict[str, Any],
) -> BitResponse:
    starts = [Start(case, settling, frequency, amplitude, kick, options) for kick in KICKS]
    while True:
        for start in starts:
            start.go_on()
        found = _response(starts, frequency, amplitude, ripple)
        periods = found.periods // len(starts)
        if (
            found.broken
            or found.rippled > _OWN
            or found.error <= tolerance
            or periods >= most_periods
        ):
            return found


class Start:
    """A run from one axial kick, gone on from as long as asked, and its windows."""

    def __init__(
        self,
        case: Case,
        settling: float,
        frequency: float,
        amplitude: float,
        kick: float,
        options: dict[str, Any],
    ) -> None:
        plant, point = case.physics("the response of a bit")
        self.case, self.frequency = case, frequency
        self.speed = amplitude * point.omega0
        long = len(plant.state_names) > _LONG
        self.per_run = _PER_LONG_RUN if long else _PER_RUN
        # Of a long string the windows differ by more than that, and runs cost more.
        self.options = {"backwards": "stop"} | ({"rtol": _LONG_RTOL} if long else {}) | options
        period = 2.0 * math.pi / frequency
        self.half = _PERIODS * period
        self.wait = period * math.ceil(settling / period)
        initial = {"dx": kick * point.penetration_rate, "dtheta": self.speed}
        if "dlead" in plant.state_names:
            initial["dlead"] = self.speed
        self.scenario = Scenario(initial=initial)
        self.found: list[Halves] = []
        self.swing = 0.0
        self.broken: Status | Outcome | None = None

    def settle(self) -> None:
        """Wait for the orbit if that was not done."""
        while self.wait > 0.0 and self.broken is None:
            piece = min(self.wait, self.per_run * self.half)
            self.run(piece)
            self.wait -= piece

    def go_on(self) -> None:
        """Look at some more windows of the orbit."""
        self.settle()
        for _ in range(_PER_RUN // self.per_run):
            if self.broken is None:
                run = self.run(self.per_run * self.half)
            if self.broken is None:
                self.found.append(halves(run, 0.0, self.half, self.frequency))

    def run(self, duration: float) -> Simulation:
        """Go on for so long, and say so where that breaks off."""
        run = simulate(self.case, duration=duration, scenario=self.scenario, **self.options)
        if run.status != Status.DONE:
            self.broken = run.status
        elif grows_without_bound(run, run.at(run.times, ("x", "dx", "dtheta"))):
            self.broken = Outcome.DIVERGES
        else:
            self.scenario = Scenario(start=run.past(kept=0.0))
            speed = run.at(run.times, ("dtheta",)).dtheta
            self.swing = float(np.ptp(speed)) / 2.0
        return run

    @property
    def every(self) -> Halves:
        """All halves of windows."""
        return Halves(*[np.concatenate(parts) for parts in zip(*self.found, strict=True)])


def _response(starts: list[Start], frequency: float, amplitude: float, ripple: bool) -> BitResponse:
    """Return what the windows so far say."""
    broken = [start.broken for start in starts if start.broken is not None]
    if broken:
        return BitResponse(
            frequency, amplitude, complex(math.nan, math.nan), math.inf,
            np.zeros(0, dtype=complex), np.full(len(starts), np.nan + 0j),
            math.nan, math.nan, math.nan, math.nan, 0, ripple, math.nan, broken[0],
        )  # fmt: skip
    torques = [windowed(start.every.torques) for start in starts]
    speeds = [windowed(start.every.speeds) for start in starts]
    # The imposed swing has the same phase in every window, and noise has none: the ratio of the
    # means is H even where the torque of an irregular orbit moves the speed as much.
    means = np.array([t.mean() / v.mean() for t, v in zip(torques, speeds, strict=True)])
    torque_part, speed_part = np.concatenate(torques), np.concatenate(speeds)
    count, speed_mean = speed_part.size, speed_part.mean()
    value = complex(torque_part.mean() / speed_mean)
    windows = value + (torque_part - value * speed_part) / speed_mean
    # Windows that overlap by half are as good as independent.
    ends = np.cumsum([t.size for t in torques])[:-1]
    within = np.concatenate([part - part.mean() for part in np.split(windows, ends)])
    freedom = max(count - len(starts), 1)
    spread = float(np.std(speed_part)) / (math.sqrt(count) * abs(speed_mean))
    # A mean speed that is hardly known is no divisor.
    known = max(1.0 - _SURE * spread, 0.0)
    error = _SURE * math.sqrt(float((np.abs(within) ** 2).sum()) / freedom / count)
    error = max(error, float(np.abs(means - value).max())) / known if known else math.inf
    every = [start.every for start in starts]
    weight, torque, held, lifted = (
        float(np.concatenate([getattr(each, name) for each in every]).mean())
        for name in ("weight", "torque", "held", "lifted")
    )
    _, point = starts[0].case.physics("the response of a bit")
    amplitude = float(abs(speed_mean)) / point.omega0
    rippled = max(0.0, max(start.swing for start in starts) / point.omega0 - amplitude)
    if rippled > _OWN:
        error = math.inf
    periods = _PERIODS * sum(each.weight.size for each in every)
    return BitResponse(
        frequency,
        amplitude,
        value,
        error,
        windows,
        means,
        weight,
        torque,
        held,
        lifted,
        periods,
        ripple,
        rippled,
    )
