"""The map that is computed beside what was drilled, and what of a recording is said to be odd."""

from dataclasses import replace

import numpy as np
import pytest

from drillctrl import (
    Estimate,
    InputError,
    load_rig,
    read_record,
    study_record,
    table1,
    with_computed_map,
)
from drillctrl.drilling.bit_rock import Contact, Rates, steady_load
from drillctrl.drilling.coefficients import rig_coefficients
from drillctrl.drilling.steady import rig_point_at_weight_on_bit
from drillctrl.records.computed import SeenLaw
from drillctrl.records.findings import ComputedMap
from tests.records.other_rig import OtherRig, recorded, write_csv
from tests.records.test_fitted_rig import fit_of
from tests.records.wave_rig import WaveRig, wave_recorded

HEAD = "time [s],rpm,torque [kN.m],WOB [kN]"


@pytest.fixture(scope="module")
def rows():
    """A smooth motion: time, rpm, kN·m, kN."""
    k = np.arange(1500)
    speed = 100.0 + 3.0 * np.sin(0.13 * k) + 0.01 * np.cos(3.0 * k)
    torque = 8.0 + 0.3 * np.sin(0.13 * k + 1.0) + 0.001 * np.cos(7.0 * k)
    return np.column_stack([0.1 * k, speed, torque, 60.0 + 10.0 * np.sin(0.002 * k)])


def written(rows, path):
    lines = [",".join("" if np.isnan(x) else f"{x:.4f}" for x in row) for row in rows]
    path.write_text("\n".join([HEAD, *lines]) + "\n")
    return path


def test_what_is_odd_is_said_or_left_out(rows, tmp_path):
    sound = read_record(written(rows, tmp_path / "sound.csv"))
    assert sound.notes == ()
    odd = rows.copy()
    odd[300:330, 3] = np.nan
    odd[500, 2] = 700.0
    odd[900:1100, 2] = 8.125
    notes = read_record(written(odd, tmp_path / "odd.csv")).notes
    assert "weight on bit has no number in 30 of 1500 rows" in notes
    assert "1 of torque far beyond all others left out, from 50 s on" in notes
    assert "torque repeats one number for 19.9 s from 90 s on" in notes
    kept = read_record(tmp_path / "odd.csv").values["torque"]
    assert kept[np.isfinite(kept)].max() < 9e3
    mixed = rows.copy()
    mixed[700:, 1:3] = mixed[700:, 2:0:-1]
    notes = read_record(written(mixed, tmp_path / "mixed.csv")).notes
    assert any("columns or units mixed" in note and "near 70 s" in note for note in notes)
    # A drive that stops is no such thing.
    stopped = rows.copy()
    stopped[700:, 1:3] = 0.001 * rows[700:, 1:3]
    assert not any("mixed" in n for n in read_record(written(stopped, tmp_path / "s.csv")).notes)


def test_a_slow_record_says_what_cannot_be_seen(tmp_path):
    time, top, torque, _ = recorded(OtherRig(), 60.0, 600.0, rate=1.0, rock=0.02)
    write_csv(tmp_path / "slow.csv", time, top, torque)
    study = study_record(read_record(tmp_path / "slow.csv"))
    assert study.fit is None
    assert any("nothing faster than 0.4 Hz is seen" in note for note in study.notes)
    assert any("no string was fitted: that takes 2.1 Hz" in note for note in study.notes)
    assert study.period.value == pytest.approx(4.755, rel=0.02)


@pytest.mark.long
def test_a_record_of_another_kind_is_fitted(tmp_path):
    """Travelling waves, gaps, and a law of the bit of another form than the fit's."""
    rig, off = WaveRig(length=3200.0, damping=0.2), (1.08, 0.95)
    time, top, torque, bit = wave_recorded(rig, 85.0, 240.0, gaps=1)
    write_csv(tmp_path / "waves.csv", time, top, torque)
    (tmp_path / "rig.toml").write_text(rig.toml(*off))
    study = study_record(read_record(tmp_path / "waves.csv"), load_rig(tmp_path / "rig.toml"))
    fit = study.fit
    for factor, told, given in zip(fit.factors, (fit.stiffness, fit.inertia), off, strict=True):
        assert factor * given == pytest.approx(1.0, abs=0.03)
        assert told.low / told.value <= 1.0 / (factor * given) <= told.high / told.value
    assert fit.damping.low < rig.damping < fit.damping.high
    assert fit.damping.known != any("damping cannot be told closer" in why for why in fit.reasons)
    known = np.isfinite(study.bit.speed)
    true = np.interp(study.bit.time, time, bit) * np.pi / 30.0
    left = study.bit.speed[known] - true[known]
    assert np.sqrt(np.mean(left**2) / np.mean(true[known] ** 2)) < 0.1


def test_the_bits_torque_is_that_of_the_record():
    rig = table1()
    where = rig_point_at_weight_on_bit(rig, 10.0, 80e3)
    c = rig_coefficients(
        type("Here", (), {**vars(rig), "rotary_speed": 10.0,
                          "penetration_rate": where.penetration_rate})
    )  # fmt: skip
    cutting = 50e3 * rig.bit_radius / (2.0 * rig.cutter_inclination)
    law = SeenLaw(level=4e3 / cutting, drop=3e3 / cutting, decay=5.0)
    q = type("Q", (), {"level": 4e3 / cutting, "drop": 3e3 / cutting, "decay": 5.0})
    load = steady_load(law, c, q)
    assert float(load.weight_on_bit) == pytest.approx(80e3)
    # The record's law is of 50 kN.
    assert float(load.torque_on_bit) == pytest.approx(1.6 * (4e3 + 3e3 * np.exp(-2.0)))
    lifted = law.load(c, Contact(0.0, 0.0, 1.0), Rates(0.0, 0.0), q)
    assert float(lifted.torque_on_bit) == pytest.approx(1.6 * 7e3)


def test_the_map_stands_beside_what_was_drilled(rows, tmp_path):
    rig = table1()
    study = study_record(read_record(written(rows, tmp_path / "sound.csv")), fit=False)
    severity = study.torque_severity
    study = replace(study, severity=severity, fit=replace(fit_of(rig), weight_on_bit=60e3))
    found = with_computed_map(study, rig, (2, 2))
    computed = found.computed
    drilled = found.drilled()
    speeds = [row["speed"] for row in drilled]
    assert computed.speeds[0] < min(speeds) < max(speeds) < computed.speeds[-1]
    assert computed.swing.shape == (2, 2)
    # At 100 rpm the torque falls by 49 N·m·s, of which damping takes 22.
    assert set(computed.outcomes.ravel()) == {"stick-slip"}
    assert computed.swing.min() > 1.0
    level = replace(study, fit=replace(study.fit, drop=Estimate(1.0, 0.9, 1.1)))
    assert set(with_computed_map(level, rig, (2, 2)).computed.outcomes.ravel()) == {"settles"}
    assert len(found.to_dict()["computed"]) == 4
    assert "computed map" in found.summary()
    figure = found.plot()
    titles = [ax.get_title() for ax in figure.axes]
    assert "What was drilled (dots), and computed, speed held" in titles
    without = replace(
        study,
        record=replace(
            study.record,
            values={
                name: data for name, data in study.record.values.items() if name != "weight_on_bit"
            },
        ),
    )
    with pytest.raises(InputError, match="no weight on bit"):
        with_computed_map(without, rig, (2, 2))


def test_the_nearest_run_is_found():
    found = ComputedMap(np.array([5.0, 10.0]), np.array([1e4, 2e4]),
                        np.array([[0.1, 0.2], [0.3, np.nan]]), np.array([["a", "b"], ["c", "d"]]),
                        "speed held")  # fmt: skip
    assert found.at(6.0, 1.9e4) == 0.2
    assert found.rows()[-1] == {
        "speed": 10.0, "weight_on_bit": 2e4, "outcome": "d", "swing": None
    }  # fmt: skip


def test_what_is_damaged_by_whole_stretches_is_said(rows, tmp_path):
    flipped, leaps = rows.copy(), rows.copy()
    flipped[600:900, 2] *= -1.0
    leaps[700:, 2] += 30.0
    for odd, word in (
        (flipped, "torque has the other sign for 29.9 s from 60 s on"),
        (leaps, "torque leaps by 30"),
    ):
        notes = read_record(written(odd, tmp_path / "odd.csv")).notes
        assert any(note.startswith(word) for note in notes), notes
    # Two stamps only: how far apart they are is not told.
    stamps = rows.copy()
    stamps[:, 0] = np.where(np.arange(1500) < 700, 0.0, 128.0)
    with pytest.raises(InputError, match="cannot tell 1500 rows apart"):
        read_record(written(stamps, tmp_path / "stamps.csv"))
    # Commas of thousands, or of decimals?
    lines = [f"{t:.1f};{n:.2f};{1e3 * m:,.0f};{w:.1f}" for t, n, m, w in rows]
    path = tmp_path / "commas.csv"
    path.write_text("\n".join([HEAD.replace(",", ";").replace("kN.m", "N.m"), *lines]))
    with pytest.raises(InputError, match="of thousands or of decimals"):
        read_record(path)
    # A step of 100 s, which milliseconds taken for seconds make, shows nothing and breaks nothing.
    slow = rows.copy()
    slow[:, 0] *= 1000.0
    study = study_record(read_record(written(slow, tmp_path / "slow.csv")), table1(), fit=False)
    assert study.bit is None
    assert any("nothing faster than 0.004 Hz" in note for note in study.notes)


def test_las_files_shout_their_units(rows, tmp_path):
    pytest.importorskip("lasio")
    head = (
        "~V\nVERS. 2.0:\nWRAP. NO:\n~W\nSTRT.S 0:\nSTOP.S 149.9:\nSTEP.S 0.1:\nNULL. -999.25:\n"
        "~C\nTIME.S :\nRPM.RPM :\nTORQUE.KN.M :\nWOB.KN :\n~A\n"
    )
    path = tmp_path / "shouts.las"
    path.write_text(head + "\n".join(" ".join(f"{x:.4f}" for x in row) for row in rows))
    values = read_record(path).values
    np.testing.assert_allclose(values["torque"], 1e3 * rows[:, 2], rtol=1e-5)
    np.testing.assert_allclose(values["weight_on_bit"], 1e3 * rows[:, 3], rtol=1e-5)
