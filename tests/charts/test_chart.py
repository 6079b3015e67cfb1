"""Charts against spectra computed by the pseudospectral route on fine samples."""

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drillctrl import (
    InputError,
    OperatingPoint,
    RigPoint,
    characteristic_roots,
    chart,
    count_right_of,
    preset_structure,
    rig_point_at_weight_on_bit,
    spectral_abscissas,
    steady_state,
    table1,
)

POINT = OperatingPoint(omega0=10.0, delta0=1.75, psi=14.0)
GAINS = {
    "p": ([-1.55], None),
    "case1": ([-1.981], [0.426]),
    "pd": ([-2.0, -1.0], None),
    "case2": ([-5.03, -4.91], [-1.67, -0.31]),
}
SPEEDS, DEPTHS = ("omega0", 0.5, 25.0), ("delta0", 0.0, 15.0)


def sampled_share(point, axes, structure=None, gains=None, coarse=60, fine=9):
    """Return the stable share of a box from α at cell centres, finer where the sign changes."""

    def stable(u, v):
        values = {}
        vector = None if gains is None else np.tile(gains, (u.size, 1))
        for (name, low, high), share in zip(axes, (u, v), strict=True):
            place = low + share * (high - low)
            if structure is not None and name in structure.gain_names:
                vector = np.zeros((u.size, structure.lower.size)) if vector is None else vector
                vector[:, structure.gain_names.index(name)] = place
            else:
                for target in ("xi", "kappa") if name == "damping" else (name,):
                    values[target] = place
        return spectral_abscissas(point, values, structure, vector) < 0.0

    centre = (np.arange(coarse) + 0.5) / coarse
    u, v = (a.ravel() for a in np.meshgrid(centre, centre, indexing="ij"))
    sign = stable(u, v).reshape(coarse, coarse)
    padded = np.pad(sign, 1, mode="edge")
    around = [padded[i : i + coarse, j : j + coarse] for i in range(3) for j in range(3)]
    mixed = np.any(around, axis=0) & ~np.all(around, axis=0)
    share = sign.astype(float)
    offset = ((np.arange(fine) + 0.5) / fine - 0.5) / coarse
    i, j = np.nonzero(mixed)
    du, dv = (a.ravel() for a in np.meshgrid(offset, offset, indexing="ij"))
    inner = stable((centre[i][:, None] + du).ravel(), (centre[j][:, None] + dv).ravel())
    share[i, j] = inner.reshape(i.size, -1).mean(axis=1)
    return share.mean()


def box(axes):
    return np.prod([high - low for _, low, high in axes])


def test_open_loop_area_of_the_paper():
    drawn = chart(POINT, ("omega0", 0.0, 25.0), DEPTHS)
    assert drawn.stable_area == pytest.approx(22.8, abs=0.05)
    assert drawn.area_error < 0.01
    share = sampled_share(POINT, (SPEEDS, ("delta0", 0.0, 2.5)))
    assert drawn.stable_area == pytest.approx(share * box((SPEEDS, ("delta0", 0.0, 2.5))), rel=2e-3)


@pytest.mark.long(but=1)
@pytest.mark.parametrize("changes", [{"psi": 26.0}, {"xi": 0.05, "kappa": 0.05}, {"blades": 3}])
def test_open_loop_area_at_other_points(changes):
    point = POINT.with_changes(**changes)
    drawn = chart(point, SPEEDS, DEPTHS)
    depths = ("delta0", 0.0, 7.0)
    assert drawn.stable_area == pytest.approx(
        sampled_share(point, (SPEEDS, depths)) * box((SPEEDS, depths)), rel=3e-3
    )


@pytest.mark.long(but=1)
@pytest.mark.parametrize("name", GAINS)
def test_area_for_given_gains(name):
    now, past = GAINS[name]
    drawn = chart(POINT, SPEEDS, DEPTHS, name, now, past)
    structure = preset_structure(name)
    share = sampled_share(POINT, (SPEEDS, DEPTHS), structure, [*now, *(past or [])], coarse=40)
    assert drawn.stable_area == pytest.approx(share * box((SPEEDS, DEPTHS)), rel=3e-3)


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("axes", "name"),
    [
        ((("K1_1", -10.0, 10.0), ("K2_1", -10.0, 10.0)), "case1"),
        ((("K2_1", -10.0, 10.0), ("psi", 1.0, 40.0)), "case1"),
        ((("eta", 1.0, 3.0), ("K1_1", -10.0, 10.0)), "case1"),
        ((("xi", 0.0, 0.2), ("kappa", 0.0, 0.2)), None),
        ((("psi", 1.0, 60.0), ("omega0", 1.0, 20.0)), None),
        ((("eta", 1.0, 3.0), ("damping", 0.01, 0.2)), None),
        ((("eta", 1.0, 3.0), ("omega0", 1.0, 20.0)), None),
    ],
)
def test_area_over_other_axes(axes, name):
    structure = None if name is None else preset_structure(name)
    point = POINT.with_changes(delta0=0.9) if name is None else POINT
    gains = None if name is None else np.array([-5.17, 5.06])
    given_gains = [] if name is None else ([-5.17], [5.06])
    drawn = chart(point, *axes, structure, *given_gains, tolerance=1e-3)
    share = sampled_share(point, axes, structure, gains, coarse=40)
    assert 0.02 < share < 0.98
    assert drawn.stable_area == pytest.approx(share * box(axes), rel=5e-3)


@pytest.mark.parametrize("name", [None, "case1"])
def test_decay_rate_charts_agree_with_samples(name):
    structure = None if name is None else preset_structure(name)
    gains = None if name is None else [-1.981, 0.426]
    level = -0.005 if name is None else -0.1
    given_gains = () if gains is None else ([-1.981], [0.426])
    drawn = chart(POINT, SPEEDS, DEPTHS, structure, *given_gains, level=level)
    rng = np.random.default_rng(1)
    u, v = rng.uniform(0.5, 25.0, 300), rng.uniform(0.0, 3.0 if name is None else 15.0, 300)
    vectors = None if gains is None else np.tile(gains, (300, 1))
    alpha = spectral_abscissas(POINT, {"omega0": u, "delta0": v}, structure, vectors)
    inside = np.array([covered(drawn, *place) for place in zip(u, v, strict=True)])
    clear = np.abs(alpha - level) > 2e-3
    assert 0.02 < inside.mean() < 0.98
    assert np.array_equal(inside[clear], alpha[clear] < level)


def covered(drawn, x, y):
    """Whether the scan line nearest to a place has it in a stable interval."""
    position, along = (y, x) if drawn.rows else (x, y)
    places = np.array([line.position for line in drawn.lines])
    line = drawn.lines[int(np.argmin(np.abs(places - position)))]
    return any(start <= along <= stop for start, stop, _, _ in line.stable_intervals)


def test_regions_are_confirmed_by_the_argument_principle():
    for name, (now, past) in [(None, (None, None)), *GAINS.items()]:
        drawn = chart(POINT, ("omega0", 0.0, 25.0), DEPTHS, name, now, past)
        assert all(region.confirmed is not False for region in drawn.regions)
        assert any(region.unstable_roots == 0 for region in drawn.regions)
        assert any(region.unstable_roots > 0 for region in drawn.regions)
        total = sum(region.area for region in drawn.regions)
        assert total == pytest.approx(375.0, rel=0.03)


@pytest.mark.long
@settings(max_examples=40, deadline=None)
@given(
    omega0=st.floats(0.6, 24.0),
    delta0=st.floats(0.1, 14.0),
    p=st.floats(-10.0, 10.0),
    q=st.floats(-10.0, 10.0),
)
def test_counts_on_a_line_equal_the_argument_principle(omega0, delta0, p, q):
    drawn = chart(POINT, ("omega0", 0.5, 25.0), ("delta0", delta0, delta0 + 0.1), "case1", [p], [q])
    line = drawn.lines[len(drawn.lines) // 2]
    edge = np.abs(line.at - omega0).min(initial=np.inf)
    if edge < 1e-3:
        return
    at = line.counts[int(np.searchsorted(line.at, omega0))]
    assert at == count_right_of(drawn.plane.system(omega0, line.position), 0.0).count


def test_small_rotary_speed_has_no_islands():
    drawn = chart(POINT, ("omega0", 0.0, 2.0), DEPTHS)
    assert drawn.stable_area == 0.0
    assert drawn.area_error < 0.01
    assert drawn.curves == ()
    for omega0 in (0.05, 0.3, 1.0):
        for delta0 in (0.05, 1.0, 9.0):
            assert count_right_of(drawn.plane.system(omega0, delta0), 0.0).count > 0


@pytest.mark.parametrize(
    ("axes", "name", "gains"),
    [
        ((SPEEDS, DEPTHS), None, ()),
        ((SPEEDS, DEPTHS), "case2", GAINS["case2"]),
        ((("K1_1", -10.0, 10.0), ("K2_1", -10.0, 10.0)), "case1", ()),
    ],
)
def test_boundary_points_have_a_root_on_the_axis(axes, name, gains):
    drawn = chart(POINT, *axes, name, *gains)
    points = np.concatenate([curve.points for curve in drawn.curves])
    omega = np.concatenate([curve.omega for curve in drawn.curves])
    assert len(points) > 100
    for k in range(0, len(points), len(points) // 12):
        loop = drawn.plane.system(*points[k])
        roots = characteristic_roots(loop, -1e-4)
        value = min((root.value for root in roots), key=lambda s: abs(abs(s.imag) - omega[k]))
        assert abs(value.real) < 1e-8
        assert abs(value.imag) == pytest.approx(omega[k], abs=1e-6)


def test_points_of_the_paper_lie_where_it_says():
    drawn = chart(POINT, SPEEDS, DEPTHS)
    assert drawn.unstable_roots(10.0, 1.0) == 0
    assert drawn.unstable_roots(5.1, 1.75) == 0
    assert drawn.unstable_roots(10.0, 1.75) == 2
    assert drawn.unstable_roots(5.1, 0.25) > 0
    points = np.concatenate([curve.points for curve in drawn.curves])
    order = np.argsort(points[:, 0])
    top = points[order][points[order][:, 0] > 5.4]
    assert np.interp(10.0, top[:, 0], top[:, 1]) == pytest.approx(1.33, abs=0.01)


@pytest.mark.long
def test_rig_axes_agree_with_the_dimensionless_chart():
    rig_point = RigPoint(table1(), 120.0 * np.pi / 30.0, 20.0 / 3600.0)
    drawn = chart(rig_point, ("speed", "30 rpm", "300 rpm"), ("rop", 0.0, 60.0))
    assert drawn.plane.x.unit == "rpm"
    assert drawn.plane.x.high == pytest.approx(300.0)
    rng = np.random.default_rng(2)
    for x, y in zip(rng.uniform(30, 300, 12), rng.uniform(1, 60, 12), strict=True):
        other = RigPoint(table1(), x * np.pi / 30.0, y / 3600.0).operating_point()
        assert drawn.plane.case_at(x, y).point.omega0 == pytest.approx(other.omega0)
        assert drawn.plane.case_at(x, y).point.delta0 == pytest.approx(other.delta0)
        alpha = spectral_abscissas(other)[0]
        if abs(alpha) > 5e-3:
            assert covered(drawn, x, y) == (alpha < 0.0)
    strengths = chart(rig_point, ("rock_strength", 10.0, 200.0), ("speed", 60.0, 300.0))
    assert 0.0 < strengths.stable_area < 190.0 * 240.0


def test_a_chart_is_the_same_every_time_and_to_its_tolerance():
    first, second = (chart(POINT, SPEEDS, DEPTHS) for _ in range(2))
    assert first.stable_area == second.stable_area
    fine = chart(POINT, SPEEDS, DEPTHS, tolerance=1e-6)
    assert abs(fine.stable_area - first.stable_area) <= first.area_error
    assert fine.area_error < 0.1 * first.area_error


@pytest.mark.parametrize(
    ("x", "y", "structure", "gains", "parameter"),
    [
        (("omega", 0, 1), DEPTHS, None, (), "axis"),
        (("omega0", 5, 1), DEPTHS, None, (), "limits of omega0"),
        (("omega0", -5, 1), DEPTHS, None, (), "omega0 (lower limit)"),
        (SPEEDS, ("K1_1", -1, 1), None, (), "axis"),
        (SPEEDS, SPEEDS, None, (), "y"),
        (("xi", 0, 1), ("damping", 0, 1), None, (), "y"),
        (SPEEDS, ("speed", 10, 100), None, (), "axis"),
        (SPEEDS, DEPTHS, "case1", (), "K1"),
        (SPEEDS, DEPTHS, "case1", ([1.0],), "K2"),
        (SPEEDS, DEPTHS, None, ([1.0],), "structure"),
        (SPEEDS, DEPTHS, "case1", ([float("nan")], [0.0]), "K1"),
        (SPEEDS, DEPTHS, "case9", ([1.0], [0.0]), "structure"),
        ("omega0", DEPTHS, None, (), "axis"),
    ],
)
def test_bad_input_is_named(x, y, structure, gains, parameter):
    with pytest.raises(InputError) as error:
        chart(POINT, x, y, structure, *gains)
    assert error.value.parameter == parameter


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("axes", "level", "strip"),
    [
        ((("omega0", 0.0, 20.0), ("delta0", 0.0, 2.0)), 0.0, 0.0),
        ((("omega0", 0.0, 20.0), ("delta0", 0.0, 2.0)), -0.005, 0.02 * 2.0),
        ((("delta0", 0.0, 2.0), ("omega0", 0.0, 20.0)), -0.005, 0.02 * 2.0),
    ],
)
def test_strip_without_lines_is_part_of_the_error(axes, level, strip):
    drawn = chart(POINT, *axes, level=level, tolerance=0.05)
    assert drawn.undecided_area == pytest.approx(strip)
    assert drawn.area_error >= drawn.undecided_area
    assert ("undecided" in drawn.summary()) == (strip > 0.0)


def test_weight_on_bit_is_an_axis():
    rig = table1()
    rig_point = RigPoint(rig, 100 * np.pi / 30, 20 / 3600)
    drawn = chart(rig_point, ("speed", 60.0, 300.0), ("wob", "20 kN", "6 t"))
    assert drawn.plane.y.high == pytest.approx(6 * 9.80665)
    points = np.concatenate([curve.points for curve in drawn.curves])
    for speed, weight in points[:: len(points) // 6]:
        # Steady weight on bit is that of the wear flat and grows in proportion to the rate.
        place = rig_point_at_weight_on_bit(rig, speed * np.pi / 30, 1e3 * weight)
        assert steady_state(place).weight_on_bit == pytest.approx(1e3 * weight)
        assert spectral_abscissas(place)[0] == pytest.approx(0.0, abs=1e-7)
    with pytest.raises(InputError, match=r"wob \(lower limit, kN\) = 5.0: .* \[7.776"):
        chart(rig_point, ("speed", 60.0, 300.0), ("wob", 5.0, 60.0))
    with pytest.raises(InputError, match="another parameter than x = rop"):
        chart(rig_point, ("rop", 1.0, 30.0), ("wob", 20.0, 60.0))


def test_gains_of_a_rig_are_told_in_its_units():
    rig = table1()
    where = RigPoint(rig, 150.0 * math.pi / 30.0, 20.0 / 3600.0)
    drawn = chart(where, ("K1_1", -5.0, 5.0), ("K2_1", -2.0, 2.0), "case1", tolerance=1e-2)
    unit = rig.torsional_stiffness / 1e3
    lines = drawn.summary().splitlines()
    assert lines[1].split(maxsplit=1)[1] == f"K₁,₁ in [{-5 * unit:.6g}, {5 * unit:.6g}] kN·m/rad"
    assert float(lines[3].split()[1]) == pytest.approx(drawn.stable_area * unit**2, rel=1e-3)
    # Limits stay those of the gains; what stands at the ticks is in kN·m/rad.
    ax = drawn.plot()
    assert ax.get_xlim() == (-5.0, 5.0)
    assert "kN·m/rad" in ax.get_xlabel()
    ax.figure.canvas.draw()
    ticks = [t for t in ax.xaxis.get_major_ticks() if -5.0 <= t.get_loc() <= 5.0]
    told = [float(t.label1.get_text().replace("\N{MINUS SIGN}", "-")) for t in ticks]
    assert told == pytest.approx([unit * t.get_loc() for t in ticks])
    assert told == pytest.approx(np.round(told, 1))
    plt.close(ax.figure)


def test_a_limit_is_refused_in_the_unit_it_was_typed_in():
    where = RigPoint(table1(), 100.0 * math.pi / 30.0, 20.0 / 3600.0)
    speeds = ("speed", "50 rpm", "100 rpm")
    with pytest.raises(InputError, match=r"wob \(lower limit\) = 1 klbf: must be in \[1\.7481, "):
        chart(where, ("wob", "1 klbf", "90 klbf"), speeds)
    with pytest.raises(InputError, match=r"wob \(lower limit, kN\) = 1.0: .*\[7\.776, 1e\+06\]"):
        chart(where, ("wob", 1.0, 90.0), speeds)
