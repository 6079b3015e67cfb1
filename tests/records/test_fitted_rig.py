"""The rig that a recording tells, as a file, and the box that worst-case design takes from it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from drillctrl import (
    Estimate,
    InputError,
    Record,
    RecordFit,
    RigPoint,
    check_rig,
    cli,
    example_path,
    fitted_rig,
    load_rig,
    save_fit,
    string_preset,
    table1,
)
from drillctrl.designs.worst_case import fitted_box
from drillctrl.records.damping import damping_apart
from drillctrl.records.families import line_of, scaled
from drillctrl.records.surface import Carrier
from drillctrl.strings.drive_rules import soft_torque_control
from drillctrl.strings.files import fitted_errors
from drillctrl.strings.slopes import mode_slopes
from tests.records.other_rig import RPM
from tests.records.wave_rig import WaveRig, wave_recorded


def fit_of(rig, stiffer=1.1, heavier=0.95, damping=0.2):
    def about(value, error=0.02):
        return Estimate(value, value * (1.0 - error), value * (1.0 + error))

    return RecordFit(
        stiffness=about(stiffer * rig.torsional_stiffness),
        inertia=about(heavier * rig.inertia, 0.03),
        damping=about(damping, 0.2),
        level=about(4e3),
        drop=about(2e3),
        decay=about(5.0),
        lag=Estimate(0.0, -0.01, 0.01),
        factors=(stiffer, heavier),
        modes=(),
        line=scaled(line_of(rig), stiffer, heavier, damping),
        drive_inertia=0.0,
        used=(0.0, 700.0),
        kept_back=(700.0, 1000.0),
        weight_on_bit=None,
        misfit=0.5,
        misfit_kept_back=0.5,
        identifiable=True,
        reasons=(),
    )


@pytest.mark.parametrize("name", ["vertical-3000", "deep-5000", "paper-string"])
def test_a_string_comes_back_as_it_was_fitted(name, tmp_path):
    rig = string_preset(name)
    fit = fit_of(rig)
    save_fit(rig, fit, tmp_path / "fitted.toml")
    read = load_rig(tmp_path / "fitted.toml")
    s = 2j * np.pi * np.array([0.1, 0.35, 1.0, 3.0])
    np.testing.assert_allclose(read.string.torsion.transfer(s), fit.line.transfer(s), rtol=1e-9)
    assert read.torsional_stiffness == pytest.approx(1.1 * rig.torsional_stiffness)
    assert read.inertia == pytest.approx(0.95 * rig.inertia)
    assert read.drive == rig.drive
    assert (read.bit_radius, read.blades) == (rig.bit_radius, rig.blades)
    first = [check_rig(each).torsional[0].frequency for each in (read, rig)]
    assert first[0] / first[1] == pytest.approx(np.sqrt(1.1 / 0.95), rel=1e-6)


def test_a_lumped_rig_comes_back_too(tmp_path):
    rig = table1()
    save_fit(rig, fit_of(rig), tmp_path / "fitted.toml")
    read = load_rig(tmp_path / "fitted.toml")
    assert read == fitted_rig(rig, fit_of(rig))
    assert read.torsional_damping == pytest.approx(0.2 * read.inertia)
    unseen = replace(fit_of(rig), damping=Estimate(1e-4, 1e-12, 1e4))
    save_fit(rig, unseen, tmp_path / "unseen.toml")
    own = rig.torsional_damping / rig.inertia
    assert load_rig(tmp_path / "unseen.toml").torsional_damping == pytest.approx(own * read.inertia)
    assert "damping = 0.0001" not in (tmp_path / "unseen.toml").read_text()
    assert Estimate(-0.02, -0.05, 0.01).relative == pytest.approx(1.5)


def test_the_box_of_worst_case_design(tmp_path):
    rig = table1()
    save_fit(rig, fit_of(rig), tmp_path / "fitted.toml")
    errors = fitted_errors(tmp_path / "fitted.toml")
    known = {"stiffness": 0.02, "inertia": 0.03, "damping": 0.2}
    assert errors == pytest.approx(known)
    assert fitted_errors("table1") == fitted_errors("vertical-3000") == {}
    box = fitted_box(errors)
    # The groups of a rig at the corner of its intervals, to first order.
    read = load_rig(tmp_path / "fitted.toml")
    here = RigPoint(read, 12.0, 0.005).operating_point()
    softer = replace(
        read, torsional_stiffness=0.98 * read.torsional_stiffness, inertia=1.03 * read.inertia
    )
    there = RigPoint(softer, 12.0, 0.005).operating_point()
    for name, size in box.items():
        assert getattr(there, name) / getattr(here, name) - 1.0 == pytest.approx(size, rel=0.05)


def test_the_box_is_taken_and_told_on_the_command_line(tmp_path, capsys):
    rig = table1()
    save_fit(rig, fit_of(rig), tmp_path / "fitted.toml")
    point = ["--rig", str(tmp_path / "fitted.toml"), "--speed", "150 rpm", "--rop", "20 m/h"]
    asked = ["--structure", "p", "--objective", "worst-case", "--trials", "none", "--json"]
    found = []
    for more in ([], ["--psi-error", "0.05", "--delta0-error", "0.02", "--omega0-error", "0.025"]):
        with pytest.raises(SystemExit) as stop:
            cli.main(["design", *point, *asked, *more])
        assert stop.value.code == 0
        out, err = capsys.readouterr()
        found.append((out.split('"K1"')[1].split("]")[0], err))
    assert found[0][0] == found[1][0]
    assert "psi by 5.0 %, delta0 by 2.0 %, omega0 by 2.5 %" in found[0][1]
    assert found[1][1] == ""


def test_laws_of_a_top_drive_are_held_against_the_box(tmp_path, capsys):
    rig = load_rig(example_path("rig"))
    path = str(tmp_path / "fitted.toml")
    save_fit(rig, fit_of(rig), path)
    made = load_rig(path)
    asked = ["design", "--rig", path, "--structure", "soft-torque", "--objective", "worst-case"]
    with pytest.raises(SystemExit):
        cli.main([*asked, "--json"])
    found = json.loads(capsys.readouterr().out)
    assert found["stable"] is True
    assert found["objective"] == "worst-case"
    # Rigs at the corners, made as a fit makes them, under the law that is told.
    pipe, first = made.string.torsion.wave_impedance, check_rig(made).torsional[0].frequency
    there = []
    for corner in found["box"]:
        assert corner["damping"] == pytest.approx(0.8)
        there.append(fitted_rig(made, fit_of(made, corner["stiffness"], corner["inertia"], 0.16)))
    assert len({(rig.torsional_stiffness, rig.inertia) for rig in there}) == 4

    def slopes(times):
        law = soft_torque_control(made.drive, pipe, first, times)
        return [min(m.slope for m in mode_slopes(rig.string.torsion, law)) for rig in there]

    own = [corner["slope"] for corner in found["box"]]
    told = found["law"]["speed"]["numerator"][0]
    assert slopes(told / pipe) == pytest.approx(own, rel=1e-3)
    assert min(own) >= max(min(slopes(times)) for times in (1.5, 2.2, 3.2, 4.0, 4.6, 5.5)) * 0.98
    with pytest.raises(SystemExit) as stop:
        cli.main([*asked[:2], "vertical-3000", *asked[3:]])
    assert stop.value.code == 2
    assert "fitted to a recording" in capsys.readouterr().err


def test_what_is_not_known_is_not_written(tmp_path):
    rig, path = table1(), tmp_path / "fitted.toml"
    for fit, word in (
        (replace(fit_of(rig), factors=None), "of a rig"),
        (replace(fit_of(rig), identifiable=False, reasons=("the bit hardly swings",)), "swings"),
    ):
        with pytest.raises(InputError, match=word):
            save_fit(rig, fit, path)
    with pytest.raises(InputError, match="toml"):
        save_fit(rig, fit_of(rig), tmp_path / "fitted.csv")
    assert not path.exists()
    save_fit(rig, fit_of(rig), path)
    path.write_text(path.read_text().replace("error = 0.0", "error = 7.0"))
    with pytest.raises(InputError, match="fit.uncertainty"):
        fitted_errors(path)


def test_damping_is_told_apart_from_the_form_of_the_law(tmp_path):
    # The bit's torque falls as no law that is fitted; the search begins at twice the damping.
    rig = WaveRig(length=2400.0, damping=0.15, soft=3.0)
    time, top, torque, _ = wave_recorded(rig, 80.0, 200.0, seed=4)
    record = Record("memory", time[1], {"rotary_speed": top * RPM, "torque": torque})
    (tmp_path / "rig.toml").write_text(rig.toml(damping=2.0 * rig.damping))
    line = load_rig(tmp_path / "rig.toml").string.torsion
    value, error = damping_apart(record, Carrier(line, rig.drive, 0.02), 2.0 * rig.damping)
    assert value == pytest.approx(rig.damping, rel=0.25)
    assert 0.02 < error < 0.4
    # A bit that never stands tells nothing.
    steady = record.values | {"torque": torque.mean() + 0.01 * (torque - torque.mean())}
    assert damping_apart(replace(record, values=steady), Carrier(line), 0.15) is None
