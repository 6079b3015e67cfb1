"""The bit's response against closed forms, a fixed-step program, and the whole simulator."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from drillctrl import (
    DriveMachine,
    InputError,
    OperatingPoint,
    RigPoint,
    axial_orbit,
    bit_response,
    characteristic_roots,
    check_rig,
    cli,
    drilling_motion,
    mode_at,
    paper_plant,
    plant_system,
    simulate,
    spectral_abscissa,
    string_preset,
    string_rig,
    table1,
    top_drive_plant,
    torsional_modes,
    torsional_threshold,
)
from drillctrl.drilling.case import as_case
from drillctrl.motion import response
from drillctrl.motion.along_report import along_fields, along_summary
from drillctrl.motion.report import motion_fields
from drillctrl.motion.torsion import forced_speed, ripple_of
from drillctrl.motion.words import motion_lines
from drillctrl.simulation.status import Outcome
from tests.motion.fixed_step import fixed_step_response

# One unit of H of table1, sqrt(I Kt), in N·m·s.
UNIT = math.sqrt(116.0 * 938.0)
BIT = (
    "blades", "bit_radius", "rock_strength", "contact_strength", "wearflat_length",
    "cutter_inclination", "friction_coefficient", "bit_geometry",
)  # fmt: skip


def rig_point(rpm, rop, **changes):
    return RigPoint(replace(table1(), **changes), rpm * math.pi / 30.0, rop / 3600.0)


def swing_of(run, since, until, periods=3):
    """Amplitude of θ' at ω = 1 in windows weighed by 1 − cos, over the rotary speed."""
    length = 2.0 * math.pi * periods
    begins = np.arange(since, until - length, 2.0)
    found = []
    for begin in begins:
        times = np.linspace(begin, begin + length, 1501)[:-1]
        weight = 1.0 - np.cos(2.0 * np.pi * (times - begin) / length)
        speed = run.at(times, ("dtheta",)).dtheta
        found.append(abs(2.0 * np.mean(weight * speed * np.exp(-1j * times))))
    return begins, np.array(found) / run.point.omega0


@pytest.mark.parametrize("frequency", [0.3, 1.0, 4.0])
def test_where_smooth_drilling_is_stable_it_is_the_linear_transfer_function(frequency):
    """δT = n(1 − E)(x − δ0 θ), and x follows δ0 θ through the axial string (Eqs. 22-26)."""
    point = rig_point(150, 20).operating_point()
    s = 1j * frequency
    n, psi = point.blades, point.psi
    late = n * (1.0 - np.exp(-s * point.delay))
    axial = s**2 + 2.0 * point.xi * point.eta * s + point.eta**2
    follows = psi * late * point.delta0 / (axial + psi * late)
    expected = late * (follows - point.delta0) / s
    found = bit_response(point, frequency, 1e-3)
    assert found.value == pytest.approx(expected, rel=2e-3)
    assert found.held == found.lifted == 0.0
    assert found.error < 1e-3 * abs(expected)


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("rpm", "rop", "amplitude"),
    [(120, 20, 0.03), (80, 10, 0.1), (120, 20, 0.45), (120, 50, 0.03), (120, 50, 0.3)],
)
def test_a_program_of_fixed_steps_finds_the_same(rpm, rop, amplitude):
    point = rig_point(rpm, rop).operating_point()
    found = bit_response(point, 1.0, amplitude)
    expected = fixed_step_response(point, 1.0, amplitude)
    assert abs(found.value - expected) * UNIT < 1.0 + found.error * UNIT


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("rpm", "rop", "damping", "kick"),
    [
        (120, 20, 32.9, 0.1),
        (120, 20, 15.0, 0.01),
        (100, 10, 32.9, 0.1),
        (90, 10, 10.0, 0.05),
        (100, 30, 32.9, 0.05),
        (130, 30, 32.9, 0.02),
    ],
)
def test_the_growth_rate_is_that_of_the_whole_simulator(rpm, rop, damping, kick):
    where = rig_point(rpm, rop, torsional_damping=damping)
    point = where.operating_point()
    start = {"dx": 0.1 * point.penetration_rate, "dtheta": kick * point.omega0}
    times, swing = swing_of(simulate(where, duration=110.0, initial=start), 10.0, 110.0)
    rate = float(np.polyfit(times, np.log(swing), 1)[0])
    (mode,) = torsional_modes(where)
    found = mode_at(where, mode, float(np.exp(np.log(swing).mean())))
    assert found.sign == np.sign(rate)
    assert found.root.real == pytest.approx(rate, rel=0.06)


@pytest.mark.long
def test_a_led_speed_comes_out_as_asked_and_hardly_changes_the_answer_of_a_held_bit():
    where = rig_point(120, 20)
    imposed, led = (bit_response(where, 1.0, 0.05, ripple=ripple) for ripple in (False, True))
    assert imposed.amplitude == pytest.approx(0.05, rel=1e-6)
    assert led.amplitude == pytest.approx(0.05, rel=0.05)
    assert led.ripple
    assert 0.05 < abs(led.value - imposed.value) * UNIT < 1.0
    # A swing of nearly all of the speed and a ripple would turn the bit back.
    (mode,) = torsional_modes(rig_point(120, 50))
    found = mode_at(rig_point(120, 50), mode, 0.95)
    assert found.sign == -1


@pytest.mark.long
def test_two_motions_at_120_rpm_and_50_metres_an_hour():
    """Small swings decay, those of a kick end in a large one; the simulator has both."""
    where = rig_point(120, 50)
    point = where.operating_point()
    (mode,) = torsional_modes(where)
    assert [mode_at(where, mode, a).sign for a in (0.03, 0.11, 0.3, 0.4)] == [-1, 1, 1, -1]
    kicked = simulate(where, duration=400.0, initial={"dtheta": 0.6 * point.omega0})
    assert 0.3 < swing_of(kicked, 340.0, 400.0)[1].mean() < 0.4
    quiet = simulate(where, duration=400.0, initial={"dtheta": 0.02 * point.omega0})
    assert swing_of(quiet, 340.0, 400.0)[1].max() < 0.01


@pytest.mark.long
def test_a_swing_that_grows_from_rest_ends_where_the_damping_left_is_zero():
    where = rig_point(130, 50)
    start = {"dtheta": 0.02 * where.operating_point().omega0}
    kept = swing_of(simulate(where, duration=400.0, initial=start), 340.0, 400.0)[1].mean()
    (crossing,) = drilling_motion(where, (0.05, 0.2)).modes[0].crossings
    assert crossing.kind == "swing"
    assert crossing.low < crossing.amplitude < crossing.high < 1.25 * crossing.low
    assert crossing.amplitude == pytest.approx(kept, rel=0.1)


@pytest.mark.long(but=1)
@pytest.mark.parametrize(("rpm", "rop"), [(120, 20), (100, 10), (120, 50)])
def test_the_floor_is_the_swing_that_the_simulator_keeps(rpm, rop):
    where = rig_point(rpm, rop)
    point = where.operating_point()
    start = {"dx": 0.1 * point.penetration_rate, "dtheta": 0.01 * point.omega0}
    summary = simulate(where, duration=300.0, initial=start).summary
    swing = (summary.bit_speed_max - summary.bit_speed_min) / (2.0 * point.omega0)
    assert drilling_motion(where, (0.03,)).floor == pytest.approx(swing, rel=0.15)


@pytest.mark.long
def test_the_orbit_at_steady_rotation():
    orbit = axial_orbit(rig_point(120, 20))
    # With torsion free the bit's speed ripples by 1.5 %, which moves the orbit a little.
    run = simulate(rig_point(120, 20), duration=400.0, initial={"dx": 0.05})
    tail = run.on_steps(5, 200.0, ("x", "weight_on_bit"))
    weight = np.trapezoid(tail.weight_on_bit, tail.times) / np.ptp(tail.times)
    assert orbit.weight == pytest.approx(weight, rel=5e-3)
    assert orbit.periodic
    assert not orbit.settles
    assert orbit.held == pytest.approx(run.summary.axial_stick_fraction, abs=5e-3)
    assert axial_orbit(rig_point(150, 20)).settles
    irregular = axial_orbit(rig_point(80, 30))
    assert not irregular.periodic
    assert irregular.lifted > 0.3


@pytest.mark.long
def test_irregular_orbits_have_an_error_and_unbounded_ones_no_number():
    irregular = bit_response(rig_point(80, 20), 1.0, 0.03, most_periods=40)
    assert 1.0 < irregular.error * UNIT < 60.0
    assert irregular.scatter > irregular.error
    unbounded = bit_response(rig_point(60, 20), 1.0, 0.01)
    assert unbounded.broken == Outcome.DIVERGES
    assert math.isnan(unbounded.value.real)
    assert unbounded.error == unbounded.scatter == math.inf


def test_a_mode_with_an_answer_is_the_root_of_a_polynomial():
    point = OperatingPoint(5.0, 0.2, 14.0, kappa=0.05)
    (mode,) = torsional_modes(point)
    assert mode.damping == pytest.approx(0.1)
    for value in (0.3 - 0.1j, -0.9 + 0.4j, 0.0):
        roots = np.roots([1.0, 0.1 + value, 1.0])
        assert np.abs(roots - mode.with_response(value)).min() < 1e-12


def test_modes_of_a_string_with_a_drive_are_those_of_its_linear_system():
    """Without a cut, ψ = 0 and no depth, the loop's roots are those of the string."""
    point = OperatingPoint(5.0, 0.0, 0.0, xi=0.5)
    case = as_case(point, top_drive_plant(2.0))
    (mode,) = torsional_modes(case, 5)
    assert mode.root.real == pytest.approx(spectral_abscissa(plant_system(case)), abs=0.05)
    # Two inertias on one spring, 1 and 2, the first damped by 2κ.
    assert mode.root.imag == pytest.approx(math.sqrt(1.5), rel=1e-2)


def test_modes_of_a_string_are_those_of_its_pipes():
    rig = replace(string_preset("vertical-3000"), drive=None)
    pipes = check_rig(rig).torsional[:3]
    found = torsional_modes(RigPoint(rig, 12.0, 0.005), 3)
    frequencies = [mode.root.imag / rig.time_scale / (2.0 * math.pi) for mode in found]
    assert frequencies == pytest.approx([mode.frequency for mode in pipes], rel=5e-3)
    ratios = [-mode.root.real / abs(mode.root) for mode in found]
    assert ratios == pytest.approx([mode.damping_ratio for mode in pipes], rel=0.02)


@pytest.mark.long(but=1)
@pytest.mark.parametrize("drive", [None, DriveMachine(2900.0)], ids=["imposed", "driven"])
def test_the_mode_of_a_real_string_that_drills_smoothly_is_the_root_of_its_linear_system(drive):
    """Where the axial motion settles, H is the transfer function of the cut."""
    paper = string_preset("paper-string")
    pipe, collars = paper.string.sections
    string = replace(paper.string, sections=(replace(pipe, length=200.0), collars))
    bit = {name: getattr(paper, name) for name in BIT}
    case = as_case(RigPoint(string_rig(string, drive=drive, **bit), 5.0 * math.pi, 20.0 / 3600.0))
    (mode,) = torsional_modes(case, 1)
    found = mode_at(case, mode, 0.03, most_periods=40)
    assert found.response.held == 0.0
    roots = [root.value for root in characteristic_roots(plant_system(case), -0.03)]
    near = min(roots, key=lambda root: abs(root - found.root))
    # H is taken on the axis, the root lies beside it.
    assert found.root == pytest.approx(near, abs=4e-4)
    assert abs(found.root - mode.root) > 15 * abs(found.root - near)


def test_forced_speed_is_that_of_an_ordinary_integrator():
    (mode,) = torsional_modes(OperatingPoint(5.0, 0.2, 14.0, kappa=0.05))
    times = np.linspace(0.0, 40.0, 4001)
    torque = np.sin(1.7 * times) + 0.3 * np.sin(11.0 * times)
    value = -0.04 + 0.03j
    stiffness = 1.0 - value.imag * mode.root.imag
    system = ([[0.0, 1.0], [-stiffness, -0.1 - value.real]], [[0.0], [-1.0]], [[0.0, 1.0]], 0.0)
    expected = scipy.signal.lsim(system, torque, times)[1]
    found = forced_speed(mode, value, torque, times[1] - times[0])
    assert found == pytest.approx(expected, abs=1e-9)
    # Without its start a motion forced at one frequency is one tone.
    times = np.linspace(0.0, 400.0, 40001)
    tone = ripple_of(mode, value, np.sin(1.7 * times), times[1] - times[0])
    late = times[times.size // 2 :]
    s = 1.7j
    gain = abs(s / (s**2 + (0.1 + value.real) * s + stiffness))
    found = np.stack([np.sin(1.7 * late), np.cos(1.7 * late)])
    parts = np.linalg.lstsq(found.T, tone, rcond=None)[0]
    assert np.hypot(*parts) == pytest.approx(gain, rel=0.02)
    assert tone == pytest.approx(parts @ found, abs=0.02 * gain)
    with pytest.raises(InputError, match="response"):
        forced_speed(mode, -0.2 + 0.0j, torque, 0.01)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [((0.0, 0.1), "frequency"), ((1.0, 1.0), "amplitude"), ((1.0, math.nan), "amplitude")],
)
def test_bad_numbers_are_named(arguments, name):
    with pytest.raises(InputError, match=name):
        bit_response(OperatingPoint(5.0, 0.2, 14.0), *arguments)


def test_what_has_no_orbit_is_refused(plant_c):
    with pytest.raises(InputError, match="delta0"):
        bit_response(OperatingPoint(5.0, 0.0, 14.0), 1.0, 0.1)
    with pytest.raises(InputError, match="DelaySystem"):
        bit_response(plant_c, 1.0, 0.1)
    with pytest.raises(InputError, match="amplitudes"):
        drilling_motion(OperatingPoint(5.0, 0.2, 14.0), (0.3, 0.1))


@pytest.mark.long
def test_command_line(capsys, tmp_path):
    def run(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main(
                ["bit", "--rig", "table1", "--speed", "120 rpm", "--rop", "20 m/h", *arguments]
            )
        return stop.value.code, capsys.readouterr()

    picture = tmp_path / "bit.png"
    status, said = run("--amplitudes", "0.03,0.3", "--imposed", "--json", "--plot", str(picture))
    fields = json.loads(said.out)
    assert status == 0
    assert picture.stat().st_size > 5000
    (mode,) = fields["modes"]
    assert mode["own_damping"] == pytest.approx(32.9)
    assert mode["frequency"] == pytest.approx(math.sqrt(938.0 / 116.0) / (2.0 * math.pi), rel=2e-3)
    small = mode["amplitudes"][0]
    expected = fixed_step_response(rig_point(120, 20).operating_point(), 1.0, 0.03)
    assert small["response_re"] == pytest.approx(expected.real * UNIT, abs=1.0)
    assert small["damping_left"] == pytest.approx(32.9 + small["response_re"])
    assert 0.1 < fields["orbit"]["held_fraction"] < 0.3
    assert fields["steady_torque"] == pytest.approx(fields["mean_torque"], rel=0.1)
    assert mode["damping"] == pytest.approx(small["damping_left"])
    status, said = run("--frequency", "0.45 Hz", "--amplitude", "0.03", "--json")
    fields = json.loads(said.out)
    (told,) = fields["response"]
    assert told["frequency"] == pytest.approx(0.45)
    assert told["real"] == pytest.approx(-19.5, abs=max(0.5, told["error"]))
    assert told["imag"] == pytest.approx(8.1, abs=max(0.5, told["error"]))
    assert fields["periodic"] is True
    assert fields["modes"][0]["swings"] == []
    for wrong in (["--frequency", "0.45"], ["--frequency", "fast Hz"], ["--frequency", "0 Hz"]):
        status, said = run(*wrong)
        assert status == 2
        assert "--frequency" in said.err
    status, said = run("--amplitudes", "0.03")
    assert status == 0
    assert "Small swings decay" in said.out
    for wrong, name in (
        ("0.3,0.1", "--amplitudes"),
        ("a", "--amplitudes"),
        ("1.5", "--amplitudes"),
    ):
        status, said = run("--amplitudes", wrong)
        assert status == 2
        assert name in said.err


@pytest.mark.long
def test_answers_of_a_slow_swing_are_those_of_the_averaged_law():
    """What the mean torque on the axial orbit loses by speed is H at low frequency alone."""
    slower, faster = (axial_orbit(rig_point(100 * f, 10)) for f in (0.97, 1.03))
    speeds = [rig_point(100 * f, 10).operating_point().omega0 for f in (0.97, 1.03)]
    slope = (faster.torque - slower.torque) / (speeds[1] - speeds[0])
    quick, slow = (bit_response(rig_point(100, 10), w, 0.03, most_periods=40) for w in (1.0, 0.1))
    # The answer relaxes from the averaged to the quick one with one time constant.
    part = slow.value - quick.value.real
    lag = -part.imag / part.real
    assert (quick.value.real + part.real * (1.0 + lag**2)) * UNIT == pytest.approx(
        slope * UNIT, rel=0.02
    )
    assert slope * UNIT < -45.0
    assert quick.value.real * UNIT > -13.0


@pytest.mark.long
def test_a_bit_that_swings_of_itself_has_no_answer():
    bouncing = bit_response(rig_point(60, 20), 1.0, 0.03, ripple=True, most_periods=40)
    assert bouncing.rippled > 0.5
    assert bouncing.error == math.inf
    (mode,) = torsional_modes(rig_point(60, 20))
    assert mode_at(rig_point(60, 20), mode, 0.03, most_periods=40).sign == 0
    stages = []
    found = drilling_motion(
        rig_point(60, 20), (0.03,), most_periods=40, progress=lambda *what: stages.append(what)
    )
    assert stages == [("swings of mode 1", 1, 1)]
    (told,) = motion_fields(found)["modes"][0]["amplitudes"]
    assert told["damping_left"] is None
    assert told["growth_rate"] is None
    irregular = replace(found, orbit=replace(found.orbit, broken=None))
    assert "bounces irregularly" in " ".join(motion_lines(irregular)[:3])
    quiet = bit_response(rig_point(120, 20), 1.0, 0.03, ripple=True, most_periods=40)
    assert quiet.rippled < 0.03


@pytest.mark.long
def test_speeds_between_which_swings_decay(monkeypatch):
    monkeypatch.setattr("drillctrl.motion.threshold._POINTS", 4)
    monkeypatch.setattr("drillctrl.motion.threshold._HALVED", 2)
    found = torsional_threshold(rig_point(130, 50), "speed", least=0.93, most=1.1)
    told = [(t.decays, t.factor * found.own_value) for t in found.thresholds]
    assert [side for side, _ in told] == ["below", "above"]
    assert [value for _, value in told] == pytest.approx([123.4, 139.8], rel=0.01)
    fields = along_fields(found)
    assert fields["unit"] == "rpm"
    assert "Decays above" in along_summary(found)
    for rpm, grows in ((121.5, False), (131.0, True), (142.0, False)):
        point = rig_point(rpm, 50)
        speed = 0.04 * point.operating_point().omega0
        run = simulate(point, duration=81.0, initial={"dx": 0.1, "dtheta": speed})
        _, swings = swing_of(run, 10.0, 80.0)
        assert (swings[-1] > swings[0]) == grows


@pytest.mark.long
def test_answers_are_kept_by_what_computed_them(tmp_path, monkeypatch):
    """Other arguments, other sources and a file that was cut short are none of them."""
    where = OperatingPoint(10.0, 1.75, 14.0)

    def ask(amplitude=0.1, **options):
        return bit_response(where, 1.0, amplitude, most_periods=40, keep=tmp_path, **options)

    first = ask()
    (kept,) = tmp_path.iterdir()
    calls = []
    real = response._measured

    def counted(*arguments):
        calls.append(arguments)
        return real(*arguments)

    monkeypatch.setattr(response, "_measured", counted)
    again = ask()
    assert not calls
    assert (again.value, again.error, again.periods) == (first.value, first.error, first.periods)
    assert np.array_equal(again.windows, first.windows)
    ask(0.11)
    ask(rtol=1e-6)
    assert len(calls) == 2
    kept.write_bytes(kept.read_bytes()[:-9])
    assert ask().value == first.value
    assert len(calls) == 3
    monkeypatch.setattr("drillctrl.base.checkpoint.source_digest", lambda: "other sources")
    assert ask().value == first.value
    assert len(calls) == 4
    assert len(list(tmp_path.iterdir())) == 4
    with pytest.raises(InputError, match="keep"):
        bit_response(where, 1.0, 0.1, most_periods=40, keep=kept)


def test_answers_under_a_law_that_cannot_be_read_are_not_kept(tmp_path):
    """Its name would stand for whatever it is changed to."""
    made = {}
    exec("from drillctrl import PaperLaw\nclass Own(PaperLaw): pass", {"__name__": "away"}, made)
    case = as_case(OperatingPoint(5.0, 0.2, 14.0), paper_plant(made["Own"]()))
    with pytest.raises(InputError, match="source of Own"):
        bit_response(case, 1.0, 0.1, keep=tmp_path)
