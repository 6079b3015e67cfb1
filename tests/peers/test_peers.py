"""Numbers that the peers' own test suites and demos state, reproduced; each names its source.

Left out is what they solve and we do not: neutral and descriptor systems.
"""

import math

import numpy as np
import pytest
from scipy.special import lambertw

from drillctrl import (
    DelaySystem,
    characteristic_roots,
    count_right_of,
    dominant_roots,
    spectral_abscissa,
)


def residual(system, s):
    """Smallest singular value of Δ(s), from the matrices as they are printed."""
    delta = s * np.eye(system.order) - system.A0
    for tau, matrix in zip(system.delays, system.delayed, strict=True):
        delta = delta - matrix * np.exp(-tau * s)
    return np.linalg.svd(delta, compute_uv=False)[-1]


# TDSControl-examples/data/VerheydenEtAl2008, after K. Verheyden, T. Luzyanina and D. Roose,
# J. Comput. Appl. Math. 214 (2008): example 2.1 of TDS-CONTROL's manual.
VERHEYDEN = DelaySystem(
    [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -10, -4], [0, 0, 4, -10]],
    ([[3, 3, 3, 3], [0, -1.5, 0, 0], [0, 0, 3, -5], [0, 5, 5, 5]],),
    (1.0,),
)
# TDSControl-examples/data/WuMichiels2012, after Z. Wu and W. Michiels, J. Comput. Appl.
# Math. 236 (2012).
WU = DelaySystem(
    [[-9.6713, -9.7546, -9.4913], [1.8381, 1.7961, 9.5716], [1.3647, -2.7957, -7.3561]],
    (
        [[1.0115, -9.3006, 5.3222], [7.2688, -1.1960, 9.9968], [3.6508, -1.2035, -4.8507]],
        [[7.7163, 4.5911, -5.5072], [-9.0056, -0.0260, -7.5404], [-3.3669, 0.9332, -0.2958]],
        [[7.4808, -7.2571, 9.4377], [2.8285, -7.1768, -1.4221], [-1.0353, 9.6519, 5.1208]],
    ),
    (0.1, 0.15, 0.25),
)
# TDSControl, examples/demo.cpp, and tests/test_roots.cpp: scalar and two_dimensional.
DEMO = DelaySystem([[1, 3], [-7, 1]], ([[-1, 2], [8, -1]],), (3.0,))
SCALAR = DelaySystem([[1.0]], ([[-1.0]],), (1.0,))
PLANE = DelaySystem([[1, -1], [2, 3]], ([[-1, 1], [6, -7]],), (3.0,))


@pytest.mark.parametrize("line", [0.0, -1.0, -2.5])
def test_rightmost_root_of_tdcpy(line):
    """tdcpy, tests/stability/test_rightmost_root.py: 0.6176424667764324 from any line."""
    assert spectral_abscissa(VERHEYDEN) == pytest.approx(0.6176424667764324, abs=1e-12)
    first = characteristic_roots(VERHEYDEN, line)[0]
    assert first.value == pytest.approx(0.6176424667764324, abs=1e-12)


@pytest.mark.parametrize(
    ("system", "line"), [(SCALAR, -5.0), (PLANE, -0.1), (DEMO, -0.5), (VERHEYDEN, -2.5), (WU, -5.0)]
)
def test_roots_of_tdscontrol(system, line):
    """TDSControl, tests/test_roots.cpp: every root is one to 1e-7; here to rounding, and all."""
    roots = characteristic_roots(system, line)
    assert all(residual(system, root.value) < 1e-11 for root in roots)
    total = sum(root.multiplicity * (2 if root.imag > 0 else 1) for root in roots)
    assert total == count_right_of(system, line).count > 0


def test_shifted_system_of_tdscontrol():
    """TDSControl, tests/compute_N_rhp.cpp: as many roots right of −2.5 as of 0 once shifted."""
    shifted = DelaySystem(
        VERHEYDEN.A0 + 2.5 * np.eye(4), (VERHEYDEN.delayed[0] * math.exp(2.5),), (1.0,)
    )
    assert count_right_of(shifted, 0.0).count == count_right_of(VERHEYDEN, -2.5).count
    assert spectral_abscissa(shifted) == pytest.approx(0.6176424667764324 + 2.5, abs=1e-11)


def test_argument_principle_of_qpmr():
    """qpmr, tests/test_argument_principle.py: s + e^(−s) has 100 roots up to 628.63 i.

    The rectangle is (−13.04, 0.88) × (−0.31, 628.63); the k-th root is W_k(−1).
    """
    system = DelaySystem([[0.0]], ([[-1.0]],), (1.0,))
    line = -math.log(628.6326899833176)
    roots = [r for r in characteristic_roots(system, line) if r.imag <= 628.6326899833176]
    assert len(roots) == 100
    for k, root in enumerate(sorted(roots, key=lambda r: r.imag)):
        assert root.value == pytest.approx(complex(lambertw(-1.0, k)), abs=1e-9)


def test_sixfold_root_of_qpmr():
    """qpmr, tests/test_argument_principle.py: six roots about −6.021.

    G. Mazanti, I. Boussaada and S.-I. Niculescu, J. Differ. Equ. 286 (2021), Eq. 6.10: the
    dominant root of s³ + a2 s² + a1 s + a0 + (b2 s² + b1 s + b0) e^(−sτ) of greatest
    multiplicity.
    """
    kappa, tau = 1.964, 0.66
    s0 = (-3.0 - 9.0 ** (1 / 3) + 3.0 ** (1 / 3)) / tau - 1.0 / kappa
    a0 = -(s0**3 + 9 / tau * s0**2 + 36 / tau**2 * s0 + 60 / tau**3)
    # Twice damping times frequency, from the mean of the roots of the undelayed part.
    twice = -3.0 * s0 - 9.0 / tau - 1.0 / kappa
    a2, a1 = twice + 1.0 / kappa, a0 * kappa + twice / kappa
    grow = math.exp(s0 * tau)
    b0 = 3.0 * (s0**2 * tau**2 - 8.0 * s0 * tau + 20.0) * grow / tau**3
    b1 = -6.0 * (s0 * tau - 4.0) * grow / tau**2
    b2 = 3.0 * grow / tau
    system = DelaySystem(
        [[0, 1, 0], [0, 0, 1], [-a0, -a1, -a2]], ([[0, 0, 0], [0, 0, 0], [-b0, -b1, -b2]],), (tau,)
    )
    root = dominant_roots(system)[0]
    assert root.multiplicity == 6
    assert root.value == pytest.approx(s0, abs=1e-6)
    assert s0 == pytest.approx(-6.021, abs=1e-3)
    assert count_right_of(system, s0 - 0.1).count == 6


def neurons(a21, taus):
    """Two coupled neurons at rest: DDE-BIFTOOL's demos/neuron, κ = 1/2, β = −1, a12 = 1."""
    return DelaySystem(
        -0.5 * np.eye(2),
        ([[0.0, 1.0], [a21, 0.0]], -np.eye(2)),
        (0.2, taus),
    )


def test_hopf_point_of_dde_biftool():
    """DDE-BIFTOOL, demos/neuron/html/demo1_hopf.html: a21 = 0.80712, τs = 1.5, ω = 0.78197."""
    root = dominant_roots(neurons(0.80712, 1.5))[0]
    assert root.real == pytest.approx(0.0, abs=5e-6)
    assert root.imag == pytest.approx(0.78197, abs=5e-6)


def test_double_hopf_point_of_dde_biftool():
    """DDE-BIFTOOL, demos/neuron/html/demo1_normalforms.html: two pairs on the axis at once."""
    roots = dominant_roots(neurons(0.2072962661, 8.6340742204))
    on_axis = sorted(root.imag for root in roots if abs(root.real) < 1e-8)
    assert on_axis == pytest.approx([0.3287154066, 0.9157115877], abs=1e-8)
    assert len(on_axis) == 2


def test_a_broken_coupling_of_dde_biftool():
    """The same file: at a21 = 0 both neurons are critical at τs = 2.4183994947, ω = √3/2."""
    root = dominant_roots(neurons(0.0, 2.4183994947))[0]
    assert root.multiplicity == 2
    assert root.value == pytest.approx(1j * math.sqrt(3.0) / 2.0, abs=1e-6)


def layers(a, c):
    """Two layers of neurons at rest: DDE-BIFTOOL's demos/nmfm_demo, b = 2, d = 1.2."""
    to_itself, across = -2.0 * a * np.eye(2), 1.2 * c * np.array([[0.0, 1.0], [1.0, 0.0]])
    return DelaySystem(-np.eye(2), (to_itself, across), (12.7, 20.2))


@pytest.mark.parametrize(
    ("a", "c", "omegas", "digits"),
    [
        # Hopf points along the first branch, c = 15/29.
        (0.3676281680, 15 / 29, [0.7234938546], 1e-10),
        (0.3453112603, 15 / 29, [0.1826428346], 1e-10),
        (0.2988605971, 15 / 29, [0.2710841446], 1e-10),
        # On the two Hopf curves: a root at 0 beside the pair, two pairs, a change of kind.
        (0.0037927481, 0.8396720010, [0.1485568996], 1e-7),
        (0.0899922748, 0.7735178974, [0.1560058562, 0.2900084424], 1e-5),
        (0.2566137217, 0.6210725697, [0.1722171486], 1e-6),
        (0.0133327150, 0.8554382654, [0.2958015628], 1e-7),
        (0.0900149247, 0.7736041399, [0.2900073517, 0.1560072608], 1e-5),
        (0.2518504300, 0.5812203535, [0.2759107995], 1e-6),
    ],
)
def test_two_layers_of_dde_biftool(a, c, omegas, digits):
    """DDE-BIFTOOL, demos/nmfm_demo/html/nmfm_demo.html: what BR_BIFDET prints, to ten digits."""
    found = np.array([root.value for root in characteristic_roots(layers(a, c), -0.05)])
    for omega in omegas:
        assert np.abs(found - 1j * omega).min() < digits
