"""H over a band: a rational model, a count with H itself, and the exponents of the full motion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drillctrl import (
    Controller,
    InputError,
    RigPoint,
    as_case,
    bit_band,
    close_loop,
    mode_at,
    orbit_exponents,
    preset_structure,
    spectral_abscissa,
    table1,
    torsional_modes,
)
from drillctrl.motion.band import BitBand
from drillctrl.motion.response import BitResponse


def at(rpm, rop):
    return RigPoint(table1(), rpm * math.pi / 30.0, rop / 3600.0)


@pytest.fixture(scope="module")
def band():
    """120 rpm, 20 m/h, of three frequencies: a small swing about a periodic axial orbit."""
    return bit_band(at(120, 20), 0.05, (0.7, 1.0, 1.4))


def made(where, frequencies, values):
    """A band whose H is known."""
    none = np.zeros(0, dtype=complex)
    return BitBand(
        as_case(where),
        tuple(
            BitResponse(w, 0.1, complex(h), 1e-9, none, none, 0.0, 0.0, 0.0, 0.0, 0)
            for w, h in zip(frequencies, values, strict=True)
        ),
    )


def rounded(low, high):
    """Numbers without the smallest that there are, which mean nothing here."""
    return st.floats(low, high).map(lambda value: round(value, 6))


@given(
    rounded(-0.3, 0.3), rounded(-1.0, 1.0), rounded(0.3, 3.0), rounded(0.2, 2.0),
    st.builds(complex, rounded(-0.35, 0.35), rounded(-0.35, 0.35)),
)  # fmt: skip
@settings(max_examples=15, deadline=None)
def test_a_rational_response_is_found_again(constant, residue, pole, slow, other):
    """H(s) = constant + a real pole + a pair, and the loop counted by two routes."""
    pair = complex(-slow, 1.5)

    def response(s):
        return (
            constant + residue / (s + pole) + other / (s - pair)
            + np.conj(other) / (s - np.conj(pair))
        )  # fmt: skip

    omega = np.geomspace(0.1, 10.0, 25)
    known = made(at(120, 20), omega, response(1j * omega))
    model = known.rational()
    assert (model.poles.real < 0.0).all()
    middle = 1j * np.sqrt(omega[1:] * omega[:-1])
    size = np.abs(response(middle)).max()
    np.testing.assert_allclose(model(middle), response(middle), atol=0.04 * size + 1e-6)
    np.testing.assert_allclose(model(middle.conj()), model(middle).conj(), rtol=1e-12)
    loop = known.system()
    roots = np.linalg.eigvals(loop.A0)
    # The same by polynomials: s² + 2κs + 1 + s H(s) = 0 where H is the model.
    for root in roots[np.abs(roots.imag) > 1e-6]:
        kappa = known.case.point.kappa
        value = model._value(np.asarray(root))
        assert abs(root**2 + 2.0 * kappa * root + 1.0 + root * value) < 1e-6 * (1 + abs(root)) ** 2
    counted = known.count_growing()
    if counted is not None and np.abs(roots.real).min() > 0.05:
        assert counted == int((roots.real > 0.0).sum())


def test_an_unstable_model_is_never_returned():
    omega = np.geomspace(0.3, 3.0, 9)
    known = made(at(120, 20), omega, 1.0 / (1j * omega - 0.5))
    model = known.rational()
    assert (model.poles.real < 0.0).all()
    assert model.error > 0.05
    with pytest.raises(InputError, match="modulus"):
        model(5j)


@pytest.mark.long
def test_three_routes_to_a_growth_rate(band):
    """The mode with H, the loop with its rational model, and the Floquet multipliers."""
    where = at(120, 20)
    exponents = orbit_exponents(where)
    rate = max(z.real for z in exponents if abs(z.imag) > 0.5)
    (mode,) = torsional_modes(where)
    assert mode_at(where, mode, 0.03).root.real == pytest.approx(rate, abs=3e-4)
    assert spectral_abscissa(band.system()) == pytest.approx(rate, abs=1e-3)
    assert band.count_growing() == 0


@pytest.mark.parametrize(("gain", "growing"), [(-0.02, 0), (0.05, 2)])
def test_with_control(band, gain, growing):
    structure = preset_structure("pd")
    loop = close_loop(band.system(("torque",)), structure, [[0.0, gain]], np.zeros((1, 2)))
    assert band.count_growing(structure, [[0.0, gain]]) == growing
    assert (spectral_abscissa(loop) > 0.0) == (growing > 0)
    if not growing:
        controller = Controller(structure, [0.0, gain], [0.0, 0.0])
        exponents = orbit_exponents(at(120, 20), controller)
        rate = max(z.real for z in exponents if abs(z.imag) > 0.5)
        assert spectral_abscissa(loop) == pytest.approx(rate, abs=1e-3)


def test_bands_that_are_no_bands():
    with pytest.raises(InputError, match="frequencies"):
        bit_band(at(120, 20), 0.05, (1.0, 0.5, 2.0))
    unknown = made(at(120, 20), (1.0, 2.0), (0.1, 0.1))
    with pytest.raises(InputError, match="three"):
        unknown.rational()
