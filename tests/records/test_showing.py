"""What recordings of rigs that another program simulates show, against what that program knows."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from drillctrl import (
    InputError,
    Record,
    bit_from_surface,
    cli,
    fit_record,
    load_rig,
    read_record,
    save_fit,
    study_record,
    table1,
)
from drillctrl.base.units import TORQUE, to_si
from drillctrl.records.peaks import spectral_modes
from drillctrl.records.swings import period_of, quiet, sticking_share, swing_index
from tests.records.other_rig import RPM, OtherRig, _march, recorded, write_csv

RIG = OtherRig()
STICKS = {"speed": 80.0, "seconds": 400.0, "rock": 0.02, "steps": (0.1, 10.0)}


def record_of(time, top, torque, bit=None):
    values = {"rotary_speed": top * RPM, "torque": torque}
    return Record("memory", time[1], values | ({} if bit is None else {"bit_speed": bit * RPM}))


def rig_of(other, tmp_path, stiffer=1.0, heavier=1.0):
    path = tmp_path / "rig.toml"
    path.write_text(other.toml(stiffer, heavier))
    return load_rig(path)


def crossings(speed, step):
    """Period by the times at which a speed rises through its mean."""
    mean = speed.mean()
    up = np.flatnonzero((speed[:-1] < mean) & (speed[1:] >= mean))
    between = up + (mean - speed[up]) / (speed[up + 1] - speed[up])
    return step * (between[-1] - between[0]) / (between.size - 1)


@pytest.fixture(scope="module")
def sticking():
    return recorded(RIG, lag=0.05, seed=3, **STICKS)


@pytest.mark.long
def test_stick_slip_that_is_measured_at_the_bit(sticking):
    time, top, torque, bit = sticking
    noisy = bit + np.random.default_rng(0).normal(0.0, 1.0, bit.size)
    study = study_record(record_of(time, top, torque, noisy), fit=False)
    assert study.period.value == pytest.approx(crossings(bit[2000:], 0.05), rel=0.02)
    windows = [bit[k : k + 400] for k in range(0, bit.size - 399, 200)]
    truth = np.median([np.ptp(w) / (2.0 * w.mean()) for w in windows])
    assert study.swing == pytest.approx(truth, abs=0.05)
    assert study.swing_from == "bit speed"
    assert study.sticking == pytest.approx((bit < 0.05 * bit.mean()).mean(), abs=0.03)


def test_bit_speed_from_the_surface(sticking, tmp_path):
    time, top, torque, bit = sticking
    found = bit_from_surface(record_of(time, top, torque), rig_of(RIG, tmp_path), lag=0.05)
    known = np.isfinite(found.speed)
    assert known.mean() > 0.95
    off = found.speed[known] / RPM - bit[known]
    assert off.std() < 0.05 * bit.std()
    assert abs(off.mean()) < 1.0
    assert 2.0 < found.band <= 8.0
    # Nothing but noise: what is told of its size is right to a factor.
    assert 0.3 < off.std() / (found.speed_error / RPM) < 4.0
    torque_at_bit = found.torque[known & (found.speed > 15.0)]
    assert np.median(torque_at_bit) == pytest.approx(4000.0, rel=0.1)


def test_the_pipes_own_torque_and_a_lumped_rig(tmp_path):
    """One spring and one disc, their torque measured in the pipe, in closed form."""
    stiffness, inertia, damping = 900.0, 120.0, 0.2
    step, count, omega = 0.05, 6000, 2.0 * np.pi * 0.31
    time = step * np.arange(count)
    bit = 10.0 + 6.0 * np.sin(omega * time)
    top = 10.0 + 0.5 * np.cos(omega * time)
    torque = 4000.0 + stiffness * (0.5 * np.sin(omega * time) + 6.0 * np.cos(omega * time)) / omega
    text = (
        'mass = "34 t"\naxial_stiffness = "700 kN/m"\naxial_damping = "15 kN*s/m"\n'
        f'inertia = "{inertia} kg*m^2"\ntorsional_stiffness = "{stiffness} N*m/rad"\n'
        f'torsional_damping = "{damping * inertia} N*m*s/rad"\nrock_strength = "60 MPa"\n'
        'contact_strength = "60 MPa"\nbit_radius = "108 mm"\nwearflat_length = "1.2 mm"\n'
        "cutter_inclination = 0.6\nfriction_coefficient = 0.6\nbit_geometry = 1.0\n"
        'submerged_weight = "300 kN"\n'
    )
    (tmp_path / "lumped.toml").write_text(text)
    record = Record("memory", step, {"rotary_speed": top, "torque": torque})
    found = bit_from_surface(record, load_rig(tmp_path / "lumped.toml"), torque_of="pipe")
    inner = slice(1500, 4500)
    np.testing.assert_allclose(found.speed[inner], bit[inner], atol=0.05)
    rock = torque - inertia * 6.0 * omega * np.cos(omega * time) - damping * inertia * bit
    np.testing.assert_allclose(found.torque[inner], rock[inner], atol=0.01 * 4000.0)


def test_a_string_is_fitted_that_was_taken_wrong(sticking, tmp_path):
    time, top, torque, bit = sticking
    wrong = rig_of(RIG, tmp_path, stiffer=1.15, heavier=0.9)
    study = study_record(record_of(time, top, torque), wrong)
    fit = study.fit
    j, k = RIG.chain()
    stiffness, inertia = 1.0 / np.sum(1.0 / k[:40]), j[:40].sum() / 3.0 + j[40:].sum()
    assert fit.identifiable
    for found, truth in ((fit.stiffness, stiffness), (fit.inertia, inertia), (fit.damping, 0.15)):
        assert found.low < truth < found.high
    assert fit.stiffness.value == pytest.approx(stiffness, rel=0.02)
    assert fit.inertia.value == pytest.approx(inertia, rel=0.02)
    assert fit.damping.value == pytest.approx(0.15, rel=0.25)
    assert fit.factors[0] == pytest.approx(1.0 / 1.15, rel=0.02)
    assert fit.lag.low < 0.05 < fit.lag.high
    frequencies = [mode.frequency for mode in study.modes[:2]]
    np.testing.assert_allclose(frequencies, RIG.modes(2), rtol=0.02)
    known = np.isfinite(study.bit.speed)
    assert (study.bit.speed[known] / RPM - bit[known]).std() < 0.1 * bit.std()
    truth = np.median([np.ptp(w) / (2 * w.mean()) for w in bit[:7600].reshape(-1, 400)])
    assert study.swing == pytest.approx(truth, abs=0.05)
    assert study.swing_from == "surface"
    assert fit.misfit_kept_back < 1.5 * fit.misfit
    # The drive is a PI law above its own inertia.
    seen = study.drive
    s = 2j * np.pi * seen.frequency
    law = RIG.kp + RIG.ki / s + RIG.drive * s
    clear = (seen.frequency > 0.1) & (seen.error < 0.1)
    assert clear.sum() > 4
    np.testing.assert_allclose(seen.impedance[clear], law[clear], rtol=0.25)
    pipe = np.sqrt(79.3e9 * 1.15 * 7850.0 * 0.9) * np.pi / 32.0 * (0.127**4 - 0.1086**4)
    reflected = np.abs((law - pipe) / (law + pipe))
    np.testing.assert_allclose(seen.reflection[clear], reflected[clear], atol=0.05)


@pytest.mark.long
def test_a_lumped_rig_is_fitted(tmp_path):
    """One spring and one disc under the same drive, its torque measured in the pipe."""
    stiffness, inertia, damping, count = 938.0, 116.0, 0.25, 12000
    random = np.random.default_rng(2)
    out = _march(
        np.array([0.0, inertia]), np.array([stiffness]), damping, 0.0, 2900.0, 12000.0, 6000.0,
        np.array([3000.0, 1500.0, 6.0]), np.full(count, 80.0 * RPM),
        0.02 * random.standard_normal(count),
        100 * count, 100, 5e-4, 0.0,
    )  # fmt: skip
    top = out[:, 0] / RPM + random.normal(0.0, 0.2, count)
    torque = out[:, 3] + random.normal(0.0, 60.0, count)
    wrong = replace(table1(), torsional_stiffness=1.1 * stiffness, inertia=0.9 * inertia)
    study = study_record(record_of(0.05 * np.arange(count), top, torque), wrong)
    assert study.fit.stiffness.value == pytest.approx(stiffness, rel=0.03)
    assert study.fit.inertia.value == pytest.approx(inertia, rel=0.03)
    assert not study.fit.damping.seen
    (mode,) = study.modes
    assert mode.frequency == pytest.approx(np.sqrt(stiffness / inertia) / (2 * np.pi), rel=0.02)
    windows = out[:, 2].reshape(-1, 400)
    truth = np.median(np.ptp(windows, axis=1) / (2.0 * windows.mean(axis=1)))
    assert study.swing == pytest.approx(truth, abs=0.05)


@pytest.mark.long
def test_a_lumped_rig_stands_for_a_string(sticking, tmp_path):
    """What is known as a disc on a spring is recorded as pipe and collars, which carry waves."""
    time, top, torque, bit = sticking
    j, k = RIG.chain()
    stiffness, inertia = 1.0 / np.sum(1.0 / k[:40]), j[:40].sum() / 3.0 + j[40:].sum()
    wrong = replace(table1(), torsional_stiffness=1.1 * stiffness, inertia=0.9 * inertia)
    study = study_record(record_of(time, top, torque), wrong, own_inertia=RIG.drive)
    assert study.fit.stiffness.low < stiffness < study.fit.stiffness.high
    assert study.fit.inertia.low < inertia < study.fit.inertia.high
    assert study.fit.factors[0] == pytest.approx(1.0 / 1.1, rel=0.04)
    np.testing.assert_allclose([m.frequency for m in study.modes[:2]], RIG.modes(2), rtol=0.02)
    known = np.isfinite(study.bit.speed)
    assert (study.bit.speed[known] / RPM - bit[known]).std() < 0.1 * bit.std()
    assert study.drive.reflection is not None
    save_fit(wrong, study.fit, tmp_path / "fitted.toml")
    read = load_rig(tmp_path / "fitted.toml")
    assert read.torsional_stiffness == pytest.approx(study.fit.stiffness.value)
    assert read.inertia == pytest.approx(study.fit.inertia.value)


@pytest.mark.long
def test_nothing_needs_to_be_known_of_the_string(sticking):
    time, top, torque, bit = sticking
    study = study_record(record_of(time, top, torque), own_inertia=RIG.drive)
    assert study.string_from == "fit"
    np.testing.assert_allclose([m.frequency for m in study.modes[:2]], RIG.modes(2), rtol=0.03)
    known = np.isfinite(study.bit.speed)
    assert (study.bit.speed[known] / RPM - bit[known]).std() < 0.1 * bit.std()


def test_smooth_drilling_shows_its_modes_and_fits_no_string(tmp_path):
    time, top, torque, bit = recorded(RIG, 170.0, 900.0, seed=5, rock=0.08)
    study = study_record(record_of(time, top, torque), rig_of(RIG, tmp_path))
    assert study.period is None
    assert study.fit is None
    assert study.modes_from == "spectrum"
    np.testing.assert_allclose([m.frequency for m in study.modes[:2]], RIG.modes(2), rtol=0.02)
    truth = np.median([np.ptp(w) / (2 * w.mean()) for w in bit.reshape(-1, 400)])
    assert study.swing == pytest.approx(truth, abs=0.05)
    assert study.sticking == 0.0
    assert any("no string was fitted" in note for note in study.notes)


def test_damping_of_a_peak_by_its_likelihood():
    """An oscillator under noise, sampled exactly: intervals of 95 % over twelve runs."""
    frequency, ratio, step, count = 0.4, 0.04, 0.05, 20000
    omega = 2.0 * np.pi * frequency
    pole = np.exp(step * omega * (-ratio + 1j * np.sqrt(1.0 - ratio**2)))
    inside = 0
    for seed in range(12):
        random = np.random.default_rng(seed)
        below = [1.0, -2.0 * pole.real, abs(pole) ** 2]
        motion = scipy.signal.lfilter([1.0], below, random.standard_normal(count))
        *_, found = spectral_modes([motion + 40.0 * random.standard_normal(count)], step)
        assert found.frequency == pytest.approx(frequency, rel=0.02)
        inside += abs(found.frequency - frequency) < found.error
        inside += abs(found.damping_ratio - ratio) < found.damping_error
    assert inside >= 20


def test_indices_and_periods_of_signals_in_closed_form():
    time = 0.05 * np.arange(12000)
    wave = 10.0 + 4.0 * np.sin(2.0 * np.pi * time / 7.3)
    whole = [slice(0, time.size)]
    found = period_of(wave, 0.05, whole)
    assert found.value == pytest.approx(7.3, rel=2e-3)
    assert abs(found.drift) < 0.05
    np.testing.assert_allclose(swing_index(wave, 0.05).values, 0.4, rtol=0.05)
    slowing = 10.0 + np.sin(2.0 * np.pi * 200.0 * np.log1p(time / 1400.0))
    drift = period_of(slowing, 0.05, whole).drift
    assert drift == pytest.approx(3600.0 / 200.0, rel=0.1)
    # For half of the record its seventh harmonic is stronger than the swing.
    late, tone = time >= 300.0, np.sin(2.0 * np.pi * 7.0 * time / 7.3)
    parted = 10.0 + np.where(late, 4.0, 0.0) * np.sin(2.0 * np.pi * time / 7.3) + 2.0 * tone * ~late
    halves = [slice(0, 6000), slice(6000, 12000)]
    assert period_of(parted, 0.05, halves).value == pytest.approx(7.3, rel=2e-3)
    noise = np.random.default_rng(0).standard_normal(time.size)
    assert period_of(10.0 + noise, 0.05, whole) is None
    stands = np.where(time % 5.0 < 2.0, 0.0, 10.0)
    assert sticking_share(stands, 0.1) == pytest.approx(0.4, abs=0.01)
    kept = quiet(wave + noise, 0.05)
    assert np.std(kept - wave) < 0.35


def run(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(arguments)
    out, err = capsys.readouterr()
    return stop.value.code, out, err


def test_command_line(sticking, tmp_path, capsys):
    time, top, torque, bit = sticking
    path = tmp_path / "run.csv"
    write_csv(path, time[:6000], top[:6000], torque[:6000], bit[:6000])
    code, out, err = run(["record", str(path), "--no-fit", "--json"], capsys)
    assert (code, err) == (0, "")
    fields = json.loads(out)
    assert fields["columns"] == {
        "time": "Time [s]", "rotary_speed": "Surface RPM [rpm]", "torque": "STOR [kN.m]",
        "bit_speed": "Bit RPM [rpm]",
    }  # fmt: skip
    assert fields["units"]["torque"] == "kN.m"
    assert fields["period"] == pytest.approx(crossings(bit[2000:], 0.05), rel=0.02)
    assert {"swing", "modes", "severity", "drive", "notes"} <= fields.keys()
    code, out, _ = run(["record", str(path), "--no-fit", "--to", "200 s"], capsys)
    assert code == 0
    assert all(len(line) <= 80 for line in out.splitlines())
    assert out.startswith("The bit sticks and slips")
    for arguments, word in (
        (["--to", "1 s"], "part"), (["--out", "x.xyz"], "--out"), (["--fit", "f.toml"], "--fit"),
        (["--dates", "x"], "--dates"), (["--torque-of", "x"], "--torque-of"),
        (["--lag", "9 s"], "--lag"), (["--column", "torque=Q"], "torque"),
        (["--torque-of", "drive"], "--torque-of"), (["--units", "x"], "--units"),
    ):  # fmt: skip
        code, out, err = run(["record", str(path), *arguments], capsys)
        assert (code, out) == (2, ""), arguments
        assert len(err.splitlines()) == 1
        assert word in err


def test_field_units_are_those_of_the_other_route(sticking, tmp_path, capsys):
    time, top, torque, _ = sticking
    found = study_record(record_of(time, top, torque), rig_of(RIG, tmp_path), fit=False)
    assert found.bit is not None
    found.save_bit(tmp_path / "si.csv")
    found.save_bit(tmp_path / "field.csv", "field")
    (name, si), (other, field) = (
        (lines[1].rsplit(",", 1)[1], float(lines[2000].rsplit(",", 1)[1]))
        for lines in (
            (tmp_path / f"{units}.csv").read_text().splitlines() for units in ("si", "field")
        )
    )
    assert (name, other) == ("bit torque [kN*m]", "bit torque [kft*lbf]")
    assert to_si("torque", f"{field} kft*lbf", TORQUE) == pytest.approx(1e3 * si, rel=1e-4)
    labels = {ax.get_ylabel() for ax in found.plot("field").axes}
    assert "torque, kft·lbf" in labels
    assert not any("kN" in label for label in labels)


def test_what_is_no_record_is_refused(sticking, tmp_path):
    time, top, torque, _ = sticking
    record = record_of(time, top, torque)
    for ask in (fit_record, study_record, lambda r: bit_from_surface(r, rig_of(RIG, tmp_path))):
        with pytest.raises(InputError, match="must be a Record"):
            ask(3.0)
    with pytest.raises(InputError, match="must be a Rig"):
        bit_from_surface(record, "table1")
    with pytest.raises(InputError, match="needs|without gaps"):
        fit_record(record.part(0.0, 30.0), rig_of(RIG, tmp_path))
    still = Record(
        "memory", 0.05, {"rotary_speed": np.full(6000, 10.0), "torque": np.full(6000, 5e3)}
    )
    assert study_record(still, rig_of(RIG, tmp_path)).bit is None
    assert study_record(still).swing is None


def test_the_example_and_its_truth():
    import tomllib

    from drillctrl.records.example import example_path
    from tests.records.make_example import recording

    truth = tomllib.loads(example_path("truth").read_text("utf-8"))
    shipped = read_record(example_path("record"))
    assert shipped.duration == pytest.approx(1200.0, abs=1.0)
    study = study_record(shipped, load_rig(example_path("rig")))
    for name in ("stiffness", "inertia", "damping"):
        assert getattr(study.fit, name).low < truth[name] < getattr(study.fit, name).high
    found = [mode.frequency for mode in study.modes]
    np.testing.assert_allclose(found, truth["modes"], rtol=0.02)
    t, _, torque, *_ = recording(40.0)
    assert t.size == 400
    np.testing.assert_allclose(torque, shipped.values["torque"][:400], atol=3e3)
