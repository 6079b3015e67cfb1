"""Delays and rates beyond the reach of any collocation: right, or refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import lambertw

from drillctrl import (
    DelaySystem,
    InputError,
    OperatingPoint,
    analyze,
    characteristic_roots,
    count_right_of,
    delay_margin,
    dominant_roots,
    plant_system,
    pseudospectral_abscissa,
    spectral_abscissa,
    stability_radius,
)


def scalar(a, b, tau):
    return DelaySystem([[a]], ([[b]],), (tau,))


def by_lambert(a, b, tau):
    """The rightmost root of s = a + b exp(−sτ), by the Lambert function's principal branch."""
    return float((a + lambertw(b * tau * np.exp(-a * tau)) / tau).real)


OSCILLATOR = DelaySystem([[0, 1], [-1, -0.1]], ([[0, 0], [0.05, 0]],), (400.0,))
DRILL = plant_system(OperatingPoint(0.02, 1.75, 14))


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("system", "alpha", "digits"),
    [
        (scalar(-1.0, 0.9, 500.0), -0.000210300386310, 1e-14),
        (scalar(-1.0, 0.9, 350.0), by_lambert(-1.0, 0.9, 350.0), 1e-13),
        (scalar(-1000.0, 999.0, 1.0), -0.000999500832, 1e-12),
        (OSCILLATOR, -0.0016531236, 5e-11),
        (DRILL, 0.0474396, 5e-8),
    ],
)
def test_rightmost_root(system, alpha, digits):
    assert spectral_abscissa(system) == pytest.approx(alpha, abs=digits)
    assert dominant_roots(system)[0].rightmost == pytest.approx(alpha, abs=digits)
    assert count_right_of(system, alpha + 1e-6).count == 0
    assert count_right_of(system, alpha - 1e-6).count >= 1
    found = analyze(system)
    assert found.loop.certificate.agrees
    assert found.stable == (alpha < 0.0)


def test_what_follows_from_the_roots_agrees_with_them():
    loop = scalar(-1.0, 0.9, 500.0)
    # |b| < −a: stable for every delay, and 0.1/1.9 from instability at ω = 0.
    assert delay_margin(loop).longer == np.inf
    assert stability_radius(loop).value == pytest.approx(0.1 / 1.9, rel=1e-9)
    alpha = spectral_abscissa(loop)
    assert alpha < pseudospectral_abscissa(loop, 1e-4) < 0.0
    assert dominant_roots(DRILL)[0].imag == pytest.approx(7.1821, abs=5e-5)


def test_a_line_without_roots_has_none():
    assert characteristic_roots(scalar(-3.0, 0.1, 1.0), 0.0) == ()


@given(st.floats(-50.0, 2.0), st.floats(-40.0, 40.0), st.floats(0.01, 3000.0))
def test_a_scalar_is_right_or_refused(a, b, tau):
    exponent = -a * tau
    if abs(b) < 1e-6 or exponent > 600.0 or exponent < -600.0:
        return
    branches = [lambertw(b * tau * np.exp(exponent), k) for k in (0, -1, 1)]
    expected = max((a + w / tau).real for w in branches if np.isfinite(w))
    try:
        found = spectral_abscissa(scalar(a, b, tau))
    except InputError:
        return
    # At the branch point two roots meet, which are known to half the digits.
    near = min(abs(w + 1.0) for w in branches)
    room = 1e-9 if near > 1e-2 else 1e-4
    assert found == pytest.approx(expected, rel=room, abs=room / tau + 1e-12 * abs(a))
