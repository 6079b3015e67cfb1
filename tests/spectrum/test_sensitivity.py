import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drillctrl import InputError, close_loop, dominant_roots, plant_system, preset_structure
from drillctrl.designs.sensitivity import root_sensitivity

from ..strategies import points

H = 1e-5


def dominant(point, structure, gains):
    loop = plant_system(point)
    if structure is not None:
        loop = close_loop(loop, structure, *structure.gains(gains))
    return dominant_roots(loop)


def well_separated(roots):
    top = roots[0]
    gap = min([abs(r.value - top.value) for r in roots[1:]] or [1.0])
    return top.multiplicity == 1 and gap > 0.1 and (top.imag == 0 or top.imag > 0.1)


def nearest(roots, value):
    return min((r.value for r in roots), key=lambda s: abs(s - value))


@pytest.mark.long
@given(points, st.sampled_from(["p", "case1", "pd", "case2"]), st.integers(0, 10**6))
def test_derivatives_match_differences(point, name, seed):
    point = point.with_changes(delta0=max(point.delta0, 0.05))
    structure = preset_structure(name)
    gains = np.random.default_rng(seed).uniform(structure.lower, structure.upper)
    roots = dominant(point, structure, gains)
    if not well_separated(roots) or roots[0].condition > 1e4:
        return
    value = roots[0].value
    K1, K2 = structure.gains(gains)
    slopes = root_sensitivity(point, structure, K1, K2)
    scale = 1e-5 * (1 + roots[0].condition)
    by_gain = np.concatenate([slopes.K1.ravel(), slopes.K2.ravel()])[structure.free]
    for j in range(gains.size):
        step = H * np.eye(gains.size)[j]
        up, down = (nearest(dominant(point, structure, gains + s * step), value) for s in (1, -1))
        assert abs((up - down) / (2 * H) - by_gain[j]) < scale
    for parameter, slope in slopes.parameters.items():
        if parameter == "blades":
            continue
        centre = getattr(point, parameter)
        if centre < 2 * H:
            continue
        up, down = (
            nearest(
                dominant(point.with_changes(**{parameter: centre + s * H}), structure, gains),
                value,
            )
            for s in (1, -1)
        )
        assert abs((up - down) / (2 * H) - slope) < scale


def test_open_loop_has_parameters_but_no_gains(point_c):
    slopes = root_sensitivity(point_c)
    assert slopes.K1.size == 0
    # Deeper cuts destabilise point C, as Fig. 8 shows from B to A to C.
    assert slopes.parameters["delta0"].real > 0


def test_multiple_roots_have_no_derivative(point_c):
    gains = np.array([[-9.525113872283]]), np.array([[9.2200137104]])
    with pytest.raises(InputError, match="3-fold"):
        root_sensitivity(point_c, preset_structure("case1"), *gains)
