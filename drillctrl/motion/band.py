"""The bit's response over a band of frequencies: samples, a rational model, a count of roots."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import scipy

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.workers import open_executor, spread_out
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.drilling.quantities import response_scale
from drillctrl.motion.loop import torsional_system
from drillctrl.motion.response import FEWEST_PERIODS, BitResponse, bit_response
from drillctrl.motion.torsion import torsional_modes, torsional_states
from drillctrl.spectrum.characteristic import matrix as characteristic_matrix
from drillctrl.spectrum.count import count_right_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Of the first mode's frequency.
_BAND = (0.4, 0.55, 0.75, 1.0, 1.3, 1.7, 2.2)
_FINE = 4000
# Poles of the rational model that lie further out than this, over the band, are not known.
_FURTHEST = 30.0


@dataclass(frozen=True, eq=False)
class RationalResponse:
    """A rational model of H(s) whose poles are stable.

    Attributes
    ----------
    constant : float
    poles, residues : complex array, (k,)
        H(s) = constant + Σ residue/(s − pole), real for real s.
    error : float
        Largest distance from the samples.
    band : pair of float
        Frequencies between which it was fitted; elsewhere nothing is known of it.
    """

    constant: float
    poles: ComplexArray
    residues: ComplexArray
    error: float
    band: tuple[float, float]

    def __call__(self, s: npt.ArrayLike) -> ComplexArray:
        """Return H, (...).

        Raises
        ------
        InputError
            If the modulus of s is outside the band.
        """
        at = np.asarray(s, dtype=complex)
        low, high = self.band
        inside = (np.abs(at) >= low * (1.0 - 1e-9)) & (np.abs(at) <= high * (1.0 + 1e-9))
        if not inside.all():
            raise InputError("s", f"{np.abs(at).max():g}", f"of a modulus in [{low:g}, {high:g}]")
        return self._value(at)

    def _value(self, at: ComplexArray) -> ComplexArray:
        return np.asarray(self.constant + (self.residues / (at[..., None] - self.poles)).sum(-1))

    def realised(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return real A, B, C of the part with poles, (k, k), (k,), (k,)."""
        size = self.poles.size
        a, b, c = np.zeros((size, size)), np.zeros(size), np.zeros(size)
        k = 0
        for pole, residue in zip(self.poles, self.residues, strict=True):
            if abs(pole.imag) == 0.0:
                a[k, k], b[k], c[k] = pole.real, 1.0, residue.real
                k += 1
            elif pole.imag > 0.0:
                a[k : k + 2, k : k + 2] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
                b[k], c[k : k + 2] = 2.0, [residue.real, residue.imag]
                k += 2
        return a, b, c


@dataclass(frozen=True, eq=False)
class BitBand:
    """H over frequency at one amplitude.

    Attributes
    ----------
    case : Case
        What drills, and where.
    responses : tuple of BitResponse
        By rising frequency.
    """

    case: Case
    responses: tuple[BitResponse, ...] = field(repr=False)

    @property
    def frequencies(self) -> FloatArray:
        """ω, (k,)."""
        return np.array([each.frequency for each in self.responses])

    @property
    def values(self) -> ComplexArray:
        """H, (k,)."""
        return np.array([each.value for each in self.responses])

    @property
    def errors(self) -> FloatArray:
        """Of the modulus of H, (k,)."""
        return np.array([each.error for each in self.responses])

    def _known(self) -> tuple[FloatArray, ComplexArray, float]:
        known = np.isfinite(self.errors)
        if known.sum() < 3:
            wanted = "with H known at three frequencies or more"
            raise InputError("band", f"{int(known.sum())} known values", wanted)
        noise = float(self.errors[known].max())
        return self.frequencies[known], self.values[known], noise

    def between(self, frequencies: FloatArray) -> ComplexArray:
        """Return H between the samples, by cubics over log ω that overshoot none of them."""
        omega, values, _ = self._known()
        parts = [
            scipy.interpolate.PchipInterpolator(np.log(omega), part)(np.log(frequencies))
            for part in (values.real, values.imag)
        ]
        return np.asarray(parts[0] + 1j * parts[1])

    def rational(self, tolerance: float | None = None) -> RationalResponse:
        """Return a rational model, of as few poles as come within the error of the samples.

        Parameters
        ----------
        tolerance : float, optional
            Distance from the samples; by default their largest error, and 1 % of the largest.

        Raises
        ------
        InputError
            If fewer than three samples are known.

        Notes
        -----
        Poles are those of AAA on the samples and their conjugates (Nakatsukasa, Sète and
        Trefethen 2018), term by term; unstable ones are mirrored, and constant and residues
        fitted once more by least squares.
        """
        omega, values, noise = self._known()
        largest = float(np.abs(values).max())
        wanted = max(noise, 0.01 * largest) if tolerance is None else tolerance
        band = float(omega[0]), float(omega[-1])
        at, both = (
            np.concatenate([1j * omega, -1j * omega]),
            np.concatenate([values, values.conj()]),
        )
        best = _fitted(np.zeros(0, dtype=complex), omega, values, band)
        for terms in range(2, omega.size + 1):
            if best.error <= wanted:
                break
            with warnings.catch_warnings():
                # Few terms do not suffice; what is left over is looked at below.
                warnings.simplefilter("ignore", RuntimeWarning)
                poles = scipy.interpolate.AAA(at, both, rtol=0.0, max_terms=terms).poles()
            model = _fitted(_stable(poles, band[1]), omega, values, band)
            best = min(best, model, key=lambda model: model.error)
        return best

    def system(self, inputs: Sequence[str] | None = None) -> DelaySystem:
        """Return the torsional motion with the rational model in it; see `torsional_system`."""
        bare = torsional_system(self.case, 0j, 1.0, inputs)
        _, load, _ = torsional_states(self.case)
        model = self.rational()
        a, b, c = model.realised()
        n, k = load.size, b.size
        whole = np.zeros((n + k, n + k))
        whole[:n, :n] = bare.A0
        whole[:n, 1] += model.constant * load
        whole[:n, n:] = np.outer(load, c)
        whole[n:, 1], whole[n:, n:] = b, a
        names = tuple(f"bit{i + 1}" for i in range(k))
        return DelaySystem(
            whole,
            B=np.vstack([bare.B, np.zeros((k, bare.B.shape[1]))]),
            C=np.hstack([bare.C, np.zeros((len(bare.C), k))]),
            state_names=(*bare.state_names, *names),
            input_names=bare.input_names,
            output_names=bare.output_names,
            feedback_delay=bare.feedback_delay,
        )

    def count_growing(
        self,
        structure: FeedbackStructure | None = None,
        K1: npt.ArrayLike = 0.0,
        K2: npt.ArrayLike = 0.0,
    ) -> int | None:
        """Return how many torsional roots grow, by Nyquist's criterion with H itself.

        Parameters
        ----------
        structure, K1, K2
            What is fed back; nothing by default.

        Returns
        -------
        int or None
            None where it cannot be told: the bit's torque closes a loop of gain 1 or more at an
            end of the band, beyond which H is not known.

        Raises
        ------
        InputError
            If fewer than three samples are known.
        """
        inputs = None if structure is None else structure.inputs
        system = torsional_system(self.case, 0j, 1.0, inputs)
        if structure is not None:
            shape = structure.K1_lower.shape
            now, past = (np.broadcast_to(np.asarray(k, dtype=float), shape) for k in (K1, K2))
            system = close_loop(system, structure, now, past)
        _, load, _ = torsional_states(self.case)
        omega, _, _ = self._known()
        fine = np.geomspace(omega[0], omega[-1], _FINE)
        delta = characteristic_matrix(system, 1j * fine)
        column = np.zeros((_FINE, system.order, 1), dtype=complex)
        column[:, : load.size, 0] = load
        answer = np.linalg.solve(delta, column)[:, 1, 0] * self.between(fine)
        if max(abs(answer[0]), abs(answer[-1])) >= 1.0:
            return None
        turned = 1.0 - answer
        angle = np.unwrap(np.angle(turned))
        # Below and above the band the loop's gain is below 1: the curve goes from 1 and back
        # without turning about 0.
        total = angle[-1] - angle[0] + np.angle(turned[0]) - np.angle(turned[-1])
        alone = count_right_of(system, 0.0).count
        return None if alone is None else round(alone - total / math.pi)

    def plot(self) -> Axes:
        """Draw H over frequency, in SI where there is a rig."""
        from drillctrl.motion.figure import plot_response

        rig = self.case.told_rig
        scale, unit = response_scale(self.case.told_rig, self.case.language)
        hertz = 1.0 if rig is None else 1.0 / (2.0 * math.pi * rig.time_scale)
        omega, _, _ = self._known()
        fine = np.geomspace(omega[0], omega[-1], 200)
        amplitude = float(np.mean([each.amplitude for each in self.responses]))
        return plot_response(
            self.frequencies * hertz,
            self.values * scale,
            self.errors * scale,
            (fine * hertz, self.rational()(1j * fine) * scale),
            unit,
            f"swing {amplitude:.2g} of the speed",
        )


def _stable(poles: ComplexArray, highest: float) -> ComplexArray:
    """Return poles as real ones and exact pairs; unstable ones mirrored, far ones left out."""
    near = poles[np.abs(poles) < _FURTHEST * highest]
    near = -np.abs(near.real) + 1j * near.imag
    near = near[near.real < -1e-9 * highest]
    real = near[np.abs(near.imag) <= 1e-6 * np.abs(near)].real
    upper = near[near.imag > 1e-6 * np.abs(near)]
    return np.concatenate([real.astype(complex), upper, upper.conj()])


def _fitted(
    poles: ComplexArray, omega: FloatArray, values: ComplexArray, band: tuple[float, float]
) -> RationalResponse:
    """Fit constant and residues by least squares, conjugate poles with conjugate residues."""
    s = 1j * omega
    columns = [np.ones_like(s)]
    real = poles[poles.imag == 0.0]
    upper = poles[poles.imag > 0.0]
    columns += [1.0 / (s - pole) for pole in real]
    for pole in upper:
        one, other = 1.0 / (s - pole), 1.0 / (s - pole.conj())
        columns += [one + other, 1j * (one - other)]
    table = np.column_stack(columns)
    stacked, wanted = (
        np.vstack([table.real, table.imag]),
        np.concatenate([values.real, values.imag]),
    )
    found, *_ = np.linalg.lstsq(stacked, wanted, rcond=None)
    pairs = found[1 + real.size :].reshape(-1, 2)
    residues = np.concatenate(
        [
            found[1 : 1 + real.size].astype(complex),
            pairs[:, 0] + 1j * pairs[:, 1],
            pairs[:, 0] - 1j * pairs[:, 1],
        ]
    )
    ordered = np.concatenate([real, upper, upper.conj()])
    error = float(np.abs(table @ found - values).max())
    return RationalResponse(float(found[0]), ordered, residues, error, band)


@checks_kinds
def bit_band(
    where: Where,
    amplitude: float,
    frequencies: Sequence[float] | None = None,
    *,
    workers: int = 1,
    **options: Any,
) -> BitBand:
    """Return the bit's response over a band of frequencies.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or Case
        What drills, and where.
    amplitude : float
        A in (0, 1), share of the rotary speed.
    frequencies : sequence of float, optional
        ω > 0, at least three, rising; by default seven from 0.4 to 2.2 times the first mode's.
    workers : int
        Processes.
    **options
        Of `bit_response`; rippling, and 40 periods from each start unless given.

    Raises
    ------
    InputError
        If an argument is out of its range; see `bit_response`.
    """
    case = as_case(where)
    if frequencies is None:
        first = torsional_modes(case)[0].root.imag
        wanted = [share * first for share in _BAND]
    else:
        wanted = [
            checked_number("frequency", each, 0.0, 1e3, open_low=True) for each in frequencies
        ]
        if len(wanted) < 3 or any(np.diff(wanted) <= 0.0):
            raise InputError("frequencies", wanted, "at least three, rising")
    checked_integer("workers", workers, 1, 1000)
    options = {"ripple": True, "most_periods": FEWEST_PERIODS, **options}
    tasks = [(i, case, each, amplitude, options) for i, each in enumerate(wanted)]
    with open_executor(workers, None) as executor:
        found = dict(spread_out(executor, _respond, tasks))
    return BitBand(case, tuple(found[i] for i in range(len(wanted))))


def _respond(task: tuple[int, Case, float, float, dict[str, Any]]) -> tuple[int, BitResponse]:
    index, case, frequency, amplitude, options = task
    found = bit_response(case, frequency, amplitude, **options)
    if found.broken is not None and options["ripple"]:
        found = bit_response(case, frequency, amplitude, **{**options, "ripple": False})
    return index, found
