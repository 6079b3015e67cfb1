import json
import math
import subprocess
import sys

import pytest

from drillctrl import RigPoint, cli, save_rig, simulate, table1


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main([str(a) for a in arguments])
    captured = capsys.readouterr()
    return stop.value.code, captured.out, captured.err


def test_default_is_point_c(capsys):
    status, out, err = run(capsys, "analyze", "--json")
    result = json.loads(out)
    assert (status, err) == (0, "")
    assert result["operating_point"]["omega0"] == 10.0
    assert result["operating_point"]["delta0"] == 1.75
    assert result["spectral_abscissa"] == pytest.approx(0.009760358069533952, abs=1e-10)
    assert result["structure"] is None


def test_given_gains(capsys):
    status, out, _ = run(
        capsys, "analyze", "--structure", "case2", "--K1", "-5.03,-4.91", "--K2", "-1.67,-0.31",
        "--omega0", 10, "--delta0", 12, "--psi", 14, "--json",
    )  # fmt: skip
    result = json.loads(out)
    assert status == 0
    assert result["K1"] == [-5.03, -4.91]
    assert result["stable"]


def test_design_has_the_fields_of_the_contract(capsys):
    status, out, _ = run(capsys, "design", "--structure", "p", "--json")
    result = json.loads(out)
    assert status == 0
    assert {
        "schema", "operating_point", "structure", "bounds", "K1", "K2", "spectral_abscissa",
        "stable", "dominant_roots", "spectral_radius", "open_loop", "certificate", "robustness",
        "evaluations", "elapsed_seconds",
    } <= result.keys()  # fmt: skip
    assert result["schema"] == "drillctrl/design/1"
    assert {"real", "imag", "multiplicity"} <= result["dominant_roots"][0].keys()
    assert {"value", "m", "order"} <= result["spectral_radius"].keys()
    assert {"spectral_abscissa", "stable"} <= result["open_loop"].keys()


def test_rig_point_and_files(capsys, tmp_path):
    rig, out_file, figure = tmp_path / "rig.toml", tmp_path / "d.json", tmp_path / "roots.png"
    save_rig(table1(), rig)
    status, out, _ = run(
        capsys, "analyze", "--rig", rig, "--speed", "150 rpm", "--rop", "20 m/h",
        "--out", out_file, "--plot", figure,
    )  # fmt: skip
    assert status == 0
    assert "150 rpm" in out
    assert json.loads(out_file.read_text())["rig"]["weight_on_bit"] == pytest.approx(16416.0)
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert {p.name for p in tmp_path.iterdir()} == {"rig.toml", "d.json", "roots.png"}


def test_weight_on_bit_instead_of_rate(capsys):
    arguments = ["analyze", "--rig", "table1", "--speed", "150 rpm", "--json"]
    _, by_weight, _ = run(capsys, *arguments, "--wob", "16.416 kN")
    _, by_rate, _ = run(capsys, *arguments, "--rop", "65.6167979 ft/h")
    points = [json.loads(text)["operating_point"] for text in (by_weight, by_rate)]
    assert points[0] == pytest.approx(points[1], rel=1e-6)


@pytest.mark.long
def test_require_stable(capsys):
    base = [
        "design",
        "--structure",
        "p",
        "--require-stable",
        "--objective",
        "exact",
        "--omega0",
        10,
        "--psi",
        14,
    ]
    status, out, _ = run(capsys, *base, "--delta0", 12)
    assert status == 3
    assert "not stabilised: best α" in out
    assert run(capsys, *base, "--delta0", 1.75)[0] == 0


@pytest.mark.parametrize("start", ["steady", "kick", "rest"])
@pytest.mark.parametrize("duration", ["1e-12", "6.28"])
def test_a_run_of_less_than_a_swing_says_nothing(capsys, duration, start):
    arguments = ["simulate", "--duration", duration, "--start", start]
    status, out, _ = run(capsys, *arguments, "--json")
    found = json.loads(out)
    assert (status, found["outcome"], found["settled"]) == (0, "undecided", False)
    assert found["swing"] is found["feed"] is None
    told = run(capsys, *arguments)[1]
    assert "the run ends before it can tell, which takes 6.28" in told
    assert "settle" not in told.split("Motion")[0]


AT_RIG = ("--rig", "table1", "--speed", "120 rpm", "--rop", "20 m/h")
CONTROLLED = ("simulate", *AT_RIG, "--structure", "p")
_POINT = ("--rig", "table1", "--speed", "90 rpm", "--rop", "2 m/h")
BAD = [
    (["simulate", "--initial", "dx=1, dx=2"], "--initial = dx: must be given once"),
    (
        ["simulate", *_POINT, "--initial", "x=1 mm,x=2 mm"],
        "--initial = x: must be given once",
    ),
    (["design", "--bound", "K1=-1:1", "--bound", "K1=-5:5"], "--bound = K1: must be given once"),
    (["analyze", "--omega0", "0"], "omega0 = 0.0: must be"),
    (["analyze", "--omega0", "nan"], "omega0 = nan: must be"),
    (["simulate", "--duration", "1e400"], "--duration = 1e400: must be of numbers up to 1.8e+308"),
    (["chart", "--x=omega0=1:1e400"], "--x = omega0=1:1e400: must be"),
    (["simulate", *AT_RIG, "--duration", "-1e400 s"], "--duration = -1e400 s: must be"),
    (["bit", "--frequency", "1e-9"], "--frequency = 1e-9: must be a number ω in [0.0001, 1000]"),
    (["bit", *AT_RIG, "--frequency", "1e-9 Hz"], "'2.83 rad/s', from 4.53e-05 to 453 Hz"),
    (["analyze", "--psi", "-1"], "psi = -1.0: must be"),
    (["analyze", "--blades", "0"], "blades = 0"),
    (["analyze", "--omega0", "ten"], "--omega0"),
    (["design", "--bound", "K1=5:-5"], "bound K1 = 5:-5"),
    (["design", "--bound", "K1"], "--bound = K1"),
    (["design", "--bound", "K9=-1:1"], "bound = K9"),
    (["design", "--structure", "case3"], "structure = case3"),
    (["design", "--seed", "-1"], "seed = -1"),
    (["analyze", "--rig", "table1", "--speed", "12 kg", "--rop", "20 m/h"], "--speed = '12 kg'"),
    (["analyze", "--rig", "table1", "--speed", "0 rpm", "--rop", "20 m/h"], "--speed = 0 rpm"),
    (["analyze", "--rig", "table1", "--speed", "9 rpm"], "--rop = (missing)"),
    (["analyze", "--speed", "120 rpm", "--rop", "20 m/h"], "--rig = (missing)"),
    (["analyze", "--rig", "none.toml", "--speed", "9 rpm", "--rop", "2 m/h"], "rig = none.toml"),
    (["analyze", "--omega0", "10", "--rig", "table1"], "--omega0 = 10.0: must be left out"),
    (["analyze", "--damping", "0.1", "--xi", "0.1"], "--xi = 0.1: must be left out"),
    (["analyze", "--structure", "case1", "--K1", "a", "--K2", "1"], "--K1 = a"),
    (["analyze", "--structure", "case1", "--K1", "1"], "K2 = (missing)"),
    (["analyze", "--order", "7"], "order = 7"),
    (["analyze", "--m", "0"], "m = 0"),
    (["analyze", "--out", "result.xyz"], "--out = result.xyz"),
    (["analyze", "--out", "/no/such/folder/a.json"], "--out = /no/such/folder/a.json"),
    (["analyze", "--plot", "roots.gif"], "plot = roots.gif"),
    (["analyze", "--nonsense"], "--nonsense"),
    (["simulate", "--duration", "1e12"], "duration = 1000000000000.0"),
    (["simulate", "--rtol", "-1"], "rtol = -1.0"),
    (["map", "--x", ""], "--x = : must be of the form"),
    (["reproduce", "fig4", "--out", ""], "--out = : must be a folder"),
    (["compare", "--structures", ""], "--structures = : must be names"),
    (["compare", "--structures", "p,,pd"], "--structures = p,,pd: must be names"),
    (["simulate", "--initial", "dtheta=-20"], "initial dtheta = -20.0"),
    (["simulate", "--initial", "dx"], "--initial = dx"),
    (["simulate", "--structure", "case1", "--K1", "1,2", "--K2", "1"], "K1"),
    (["simulate", "--K1", "1"], "--structure = (missing)"),
    (["simulate", "--out", "motion.xls"], "out = motion.xls"),
    (["simulate", "--model", "magic"], "model = magic"),
    (["simulate", "--change", "omega0=4"], "--change = omega0=4"),
    (["simulate", "--change", "t=5,psi=nan"], "psi = nan"),
    (["simulate", "--duration", "5 s"], "--duration = 5 s"),
    (["simulate", "--duration", "0"], "duration = 0.0"),
    (["simulate", *AT_RIG, "--duration", "-3 s"], "--duration = -3 s: must be in (0, inf) s"),
    ([*CONTROLLED, "--K1", "1 kN*m/rad", "--limit", "-5 klbf*ft"], "= -5 klbf*ft: must be in (0, "),
    (["analyze", "--rig", "table1", "--speed", "2e8 rpm", "--rop", "2 m/h"], "9.5493e+06] rpm"),
    (["analyze", "--rig", "table1", "--speed", "9 rpm", "--rop", "-2 ft/h"], "--rop = -2 ft/h: mu"),
    (["analyze", "--rig", "table1", "--speed", "9 rpm", "--wob", "1 klbf"], "[1.7481, inf) klbf ("),
    (["analyze", *AT_RIG, "--rock-strength", "-10 ksi"], "-10 ksi: must be in (0, 1.4504e+08] ksi"),
    (
        ["chart", "--rig", "table1", "--x", "speed=-5:90 rpm", "--y", "rop=1:2 m/h"],
        "limit, rpm) = -5",
    ),
    (["simulate", "--start", "moon"], "--start = moon"),
    (["simulate", "--starts", "moon"], "--starts = moon"),
    (["simulate", "--starts", "kick,kick"], "--starts = kick,kick"),
    (["simulate", "--starts", "all", "--start", "rest"], "--start = given"),
    (["simulate", "--time-limit", "0"], "--time-limit = 0.0"),
    (["simulate", "--every", "soon"], "--every = soon"),
    (["simulate", "--every", "-1", "--out", "motion.csv"], "--every = -1.0"),
    (["simulate", "--figure", "pie"], "--figure = pie"),
    (["simulate", "--figure", "face", "--model", "linear"], "--figure = face"),
    (["simulate", "--period", "0.1"], "--structure = (missing)"),
    (["simulate", "--table", "none.csv"], "table = none.csv"),
    (["simulate", "--table", "none.csv", "--K1", "3"], "--K1 = 3"),
    (["simulate", "--structure", "p", "--K1", "1e308", "--duration", "1"], "K1 = 1e+308: must"),
    (["analyze", "--omega0", "1e-300"], "--omega0 = 1e-300: must be such that its loop's roots"),
    (["analyze", "--structure", "p", "--K1", "1e308"], "--structure --K1 = p 1e308: must be such"),
    (["analyze", "--out", "x" * 5000 + ".json"], "must be a file that can be written (File name"),
    (["simulate", "--structure", "p", "--K1", "1", "--limit", "-3"], "limit = -3.0"),
    (["simulate", "--structure", "p", "--K1", "1", "--limit", "3 kN*m"], "--limit = 3 kN*m"),
    (["simulate", "--structure", "p", "--K1", "1", "--noise", "theta=a"], "--noise = theta=a"),
    (["simulate", "--structure", "p", "--K1", "1", "--delay", "now"], "delay = now"),
    ([*CONTROLLED, "--K1", "304"], "'304 N*m/rad', or '285152 N*m/rad' for the dimensionless 304"),
    ([*CONTROLLED, "--K1", "1 kN/m"], "--K1 = '1 kN/m': must be a gain in N*m/rad"),
    ([*CONTROLLED, "--K1", "1 kN*m/rad,2"], "--K1 = 1 kN*m/rad,2: must be 1 gain(s)"),
    ([*CONTROLLED, "--K1", "1 kN*m/rad", "--limit", "3"], "--limit = 3: must be given with its"),
    ([*CONTROLLED, "--K1", "1 kN*m/rad", "--period", "0.1"], "--period = 0.1: must be given with"),
    (["simulate", "--change", "t=5,speed=100 rpm"], "--change = t=5,speed=100 rpm"),
    (["simulate", "--start", "kick", "--initial", "dx=1"], "--initial = dx=1"),
    (["simulate", *AT_RIG, "--initial", "dtheta=1 m/h"], "--initial dtheta = '1 m/h': must be a"),
    (["simulate", *AT_RIG, "--initial", "y=1 m"], "of states x, dx, theta, dtheta"),
    (["simulate", *AT_RIG, "--change", "t=5 s,psi=9"], "with rock-strength and its unit in place"),
    (["simulate", *AT_RIG, "--change", "t=5 s,speed=9"], "--change speed"),
    (["analyze", *AT_RIG, "--structure", "p", "--K1", "-3"], "'-3 N*m/rad', or '-2814 N*m/rad'"),
    (["design", *AT_RIG, "--bound", "K1=-3:3"], "'-3 N*m/rad', or '-2814 N*m/rad'"),
    (["design", *AT_RIG, "--structure", "pd", "--bound", "K1=-3:3 kN*m/rad"], "each of K1_1 (N*m"),
    (["compare", *AT_RIG, "--given", "a=p:-3"], "--given = -3: must be given with its unit"),
    (["chart", *AT_RIG, "--structure", "p", "--x", "K1_1=-3:3"], "--x = -3.0: must be given with"),
    (["simulate", "--floquet", "--delta0", "0.5", "--duration", "50"], "run = 50 time units"),
    (["invent"], "invent"),
]


def test_bare_times_and_motions_of_a_rig_are_dimensionless_and_noted(capsys):
    bare = ("--duration", "20", "--initial", "dtheta=1", "--change", "t=5,speed=130 rpm")
    _, out, told = run(capsys, "simulate", *AT_RIG, *bare, "--json")
    time, speed = table1().time_scale, 1.0 / table1().time_scale
    assert f"--duration = 20 is dimensionless, {20.0 * time:.6g} s" in told
    assert f"--initial dtheta = 1 is dimensionless, {speed:.6g} rad/s" in told
    assert f"--change t = 5 is dimensionless, {5.0 * time:.6g} s" in told
    typed = ("--duration", f"{20.0 * time!r} s", "--initial", f"dtheta={speed!r} rad/s")
    changed = ("--change", f"t={5.0 * time!r} s,speed=130 rpm")
    _, again, quiet = run(capsys, "simulate", *AT_RIG, *typed, *changed, "--json")
    assert "note" not in quiet
    first, second = json.loads(out), json.loads(again)
    assert first["bit_speed_max"] == pytest.approx(second["bit_speed_max"], rel=1e-9)
    assert first["duration"] == pytest.approx(20.0)


def test_what_was_typed_in_units_is_what_the_run_does(capsys):
    """An initial motion of a rig in its units is that of the dimensionless run."""
    rig, scale = table1(), 0.351664
    units = ("--initial", "dx=10 m/h, dtheta=-20 rpm, theta=0.1", "--duration", "7.0333 s")
    _, out, _ = run(capsys, "simulate", *AT_RIG, *units, "--json")
    in_units = json.loads(out)
    assert rig.time_scale == pytest.approx(scale, rel=1e-5)
    dx = 10.0 / 3600.0 / (rig.axial_scale / rig.time_scale)
    dtheta = -20.0 * math.pi / 30.0 * rig.time_scale
    found = simulate(
        RigPoint(rig, rotary_speed=4.0 * math.pi, penetration_rate=20.0 / 3600.0),
        duration=7.0333 / rig.time_scale,
        initial={"dx": dx, "dtheta": dtheta, "theta": 0.1},
    )
    assert in_units["bit_speed_min"] == pytest.approx(found.summary.bit_speed_min, rel=1e-9)
    assert in_units["delay_max"] == pytest.approx(found.summary.delay_max, rel=1e-9)


@pytest.mark.parametrize(("arguments", "message"), BAD)
def test_bad_input_is_one_line_and_status_two(capsys, arguments, message):
    status, out, err = run(capsys, *arguments)
    assert status == 2
    assert out == ""
    assert err.count("\n") == 1
    assert message in err


def test_a_full_disk_leaves_the_old_file(capsys, tmp_path, monkeypatch):
    import os

    target = tmp_path / "old.json"
    target.write_text("old")

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    status, _, err = run(capsys, "analyze", "--out", target)
    assert status == 2
    assert "No space left on device" in err
    assert target.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["old.json"]


def test_a_proof_on_request(capsys):
    pytest.importorskip("flint")
    status, out, _ = run(capsys, "analyze", "--prove", "--json")
    certificate = json.loads(out)["certificate"]
    assert status == 0
    assert certificate["proof"]["count"] == certificate["counted"] == certificate["found"] == 3
    assert "Proved: 3 root(s)" in run(capsys, "analyze", "--prove")[1]


def test_simulate_writes_motion_and_figure(capsys, tmp_path):
    table, figure = tmp_path / "motion.csv", tmp_path / "motion.png"
    arguments = ["simulate", "--delta0", 2.5, "--duration", 150]
    status, out, _ = run(capsys, *arguments, "--out", table, "--plot", figure)
    assert status == 0
    assert "torsional stick" in out
    header, first = table.read_text().splitlines()[1:3]
    assert header.startswith("times,x,dx,theta,dtheta,")
    assert first.startswith("0.0,0.0,1.0,0.0,1.0,")
    assert figure.read_bytes().startswith(b"\x89PNG")
    result = json.loads(run(capsys, *arguments, "--json")[1])
    assert {
        "settled", "stick_fraction", "period", "bit_speed_min", "bit_speed_max", "axial_min",
        "axial_max", "delay_max", "max_abs_u", "lost_contact", "axial_stick_fraction", "events",
        "steps", "elapsed_seconds",
    } <= result.keys()  # fmt: skip
    assert result["period"] == pytest.approx(7.78533, abs=1e-4)


def test_simulate_with_control_and_npz(capsys, tmp_path):
    import numpy as np

    table = tmp_path / "motion.npz"
    status, out, _ = run(
        capsys, "simulate", "--omega0", 10, "--delta0", 12, "--model", "linear",
        "--structure", "case2", "--K1", "-5.03,-4.91", "--K2", "-1.67,-0.31",
        "--duration", 60, "--out", table, "--json",
    )  # fmt: skip
    result = json.loads(out)
    assert status == 0
    assert result["settled"]
    assert result["max_abs_u"] == pytest.approx(4.91, abs=5e-3)
    with np.load(table, allow_pickle=False) as columns:
        assert np.abs(columns["x"]).max() == pytest.approx(2.71, abs=5e-3)


def test_simulate_a_controller_as_it_runs_on_a_rig(capsys, tmp_path):
    from drillctrl import Controller, RigPoint, simulate, table1

    rig = table1()
    unit, kt = rig.time_scale, rig.torsional_stiffness
    motion = tmp_path / "motion.csv"
    status, out, _ = run(
        capsys, "simulate", "--rig", "table1", "--speed", "270 rpm", "--rop", "45 m/h",
        "--structure", "case2", "--K1", f"{-5.03 * kt} N*m/rad, {-4.91 * kt * unit} N*m*s/rad",
        "--K2", f"{-1.67 * kt} N*m/rad, {-0.31 * kt * unit} N*m*s/rad",
        "--period", "10 ms", "--actuator-lag", "20 ms", "--limit", "1 kN*m",
        "--rate-limit", f"{5.0 * kt / unit} N*m/s",
        "--noise", "theta=0.001", "--seed", 4, "--activation", "0.5 s",
        "--duration", "4 s", "--out", motion, "--json",
    )  # fmt: skip
    assert status == 0
    fields = json.loads(out)
    assert fields["time_scale"] == unit
    assert fields["duration"] == pytest.approx(4.0 / unit)
    controller = Controller(
        "case2", [-5.03, -4.91], [-1.67, -0.31], activation=0.5 / unit, period=0.01 / unit,
        actuator_lag=0.02 / unit, limit=1e3 / rig.torsional_stiffness, rate_limit=5.0,
        noise={"theta": 0.001}, seed=4,
    )  # fmt: skip
    point = RigPoint(rig, 270.0 * 2.0 * math.pi / 60.0, 45.0 / 3600.0)
    same = simulate(point, controller, duration=4.0 / unit, initial={"dx": 1.0, "dtheta": 1.0})
    assert fields["max_abs_u"] == pytest.approx(same.summary.max_abs_u, rel=1e-9)
    assert fields["steps"] == same.steps
    last = motion.read_text().splitlines()[-1].split(",")
    assert float(last[0]) == pytest.approx(4.0)
    text = run(
        capsys, "simulate", "--rig", "table1", "--speed", "270 rpm", "--rop", "45 m/h",
        "--duration", "4 s",
    )[1]  # fmt: skip
    assert "nonlinear model, 4 s, done" in text
    assert "rpm" in text


@pytest.mark.long
def test_simulate_changes_and_a_table(capsys, tmp_path):
    gains = tmp_path / "gains.csv"
    run(capsys, "table", "--omega0", "8:14:2", "--delta0", "1:4:2", "--out", gains)
    arguments = ["simulate", "--delta0", 2.5, "--table", gains, "--duration", 150]
    status, out, err = run(capsys, *arguments, "--change", "t=40,omega0=12,duration=5")
    assert (status, err) == (0, "")
    assert "steady by the end, at the changed point" in out
    _, out, err = run(capsys, *arguments, "--change", "t=40,psi=20")
    assert "does not vouch for" in err
    assert "ψ = 20 from t = 40" in err
    assert json.loads(run(capsys, *arguments, "--json")[1])["settled"]


@pytest.mark.long
def test_simulate_multipliers_and_figures(capsys, tmp_path):
    for name in ("motion", "phase", "axial-phase", "linear", "face"):
        figure = tmp_path / f"{name}.png"
        status, *_ = run(
            capsys, "simulate", "--delta0", 2.5, "--duration", 100, "--plot", figure,
            "--figure", name,
        )  # fmt: skip
        assert status == 0
        assert figure.read_bytes().startswith(b"\x89PNG")
    arguments = ["simulate", "--delta0", 2.5, "--duration", 150, "--floquet"]
    assert "Multipliers  1, 0.1498" in run(capsys, *arguments)[1]
    found = json.loads(run(capsys, *arguments, "--json")[1])
    assert found["multipliers"][1]["real"] == pytest.approx(0.14984, abs=2e-5)
    assert found["multiplier_error"] < 1e-6


def test_every_verb_has_help_with_an_example(capsys):
    for verb in ("design", "analyze", "simulate"):
        status, out, _ = run(capsys, verb, "--help")
        assert status == 0
        assert f"drillctrl {verb} --" in out


def test_import_loads_nothing_that_is_not_used():
    code = (
        "import sys, drillctrl\n"
        "heavy = {'numpy', 'scipy', 'casadi', 'matplotlib', 'pint', 'control', 'numba'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
        "drillctrl.design\n"
        "late = {'matplotlib', 'pint', 'control', 'numba', 'pandas'}\n"
        "assert not late & set(sys.modules), late & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_public_names_are_all_there():
    import drillctrl

    assert drillctrl.__all__ == sorted(drillctrl.__all__)
    for name in drillctrl.__all__:
        assert getattr(drillctrl, name).__doc__
    with pytest.raises(AttributeError, match="invented"):
        drillctrl.invented  # noqa: B018


def test_simulate_refuses_before_it_compiles(capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("DRILLCTRL_CACHE", str(tmp_path))
    for arguments in (["--rtol", "-1"], ["--initial", "dtheta=-20"], ["--model", "magic"]):
        code, out, err = run(capsys, "simulate", "--delta0", 2.5, *arguments)
        assert (code, out) == (2, "")
        assert err.count("\n") == 1
        assert "compiling" not in err


@pytest.mark.long
def test_an_objective_and_a_requirement_on_the_command_line(capsys):
    point = ["design", "--structure", "case1", "--json", "--trials", "none"]
    _, exact, _ = run(capsys, *point)
    _, worst, _ = run(capsys, *point, "--objective", "worst-case", "--psi-error", 0.2)
    _, slow, _ = run(capsys, *point, "--max-input-gain", 1.02)
    exact, worst, slow = (json.loads(text) for text in (exact, worst, slow))
    assert exact["objective"]["name"] == "exact"
    assert worst["objective"]["name"] == "worst-case"
    # The worst of the box is no better than the nominal point, which is no better than the best.
    assert worst["objective"]["value"] >= worst["spectral_abscissa"] >= exact["spectral_abscissa"]
    assert slow["requirements"]["met"]
    assert slow["spectral_abscissa"] > exact["spectral_abscissa"]


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--objective", "best"], "objective = best"),
        (["--epsilon", "0.1"], "epsilon"),
        (["--objective", "robust", "--epsilon", "-1"], "epsilon"),
        (["--objective", "semidiscrete", "--m", "0"], "m = 0"),
        (["--min-radius", "nan"], "stability_radius"),
    ],
)
def test_bad_objectives_are_refused_in_one_line(capsys, options, named):
    status, out, err = run(capsys, "design", "--structure", "p", *options)
    assert (status, out) == (2, "")
    assert named in err
    assert err.count("\n") == 1


NODES = ("--omega0", "9:11:2", "--delta0", 1)


@pytest.mark.parametrize(
    ("arguments", "package", "extra"),
    [
        (("chart", "--plot", "chart.png"), "matplotlib", "figures"),
        (("compare", "--out", "report.html"), "matplotlib", "figures"),
        (("analyze", "--prove"), "flint", "proof"),
        (("table", *NODES, "--out", "t.parquet"), "pyarrow", "tables"),
        (("table", *NODES, "--out", "t.nc"), "xarray", "tables"),
        (("table", *NODES, "--scheduler", "tcp://h:1"), "distributed", "cluster"),
    ],
)
def test_a_missing_extra_is_one_line(capsys, tmp_path, monkeypatch, arguments, package, extra):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, package, None)
    code, out, err = run(capsys, *arguments)
    assert (code, out) == (2, "")
    wanted = f"{package} = missing: must be installed: pip install 'drillctrl[{extra}]'"
    assert err == f"drillctrl: {wanted}\n"
    assert list(tmp_path.iterdir()) == []


def test_axes_of_a_chart_need_no_value_beside_them(capsys):
    axes = ("--x", "speed=100:300 rpm", "--y", "rop=1:60 m/h")
    areas = []
    for beside in ((), ("--speed", "120 rpm", "--rop", "20 m/h")):
        with pytest.raises(SystemExit) as stop:
            cli.main(["chart", "--rig", "table1", *axes, *beside, "--json"])
        assert stop.value.code == 0
        areas.append(json.loads(capsys.readouterr().out)["stable_area"])
    assert areas[0] == areas[1] > 0.0


@pytest.mark.parametrize(
    ("option", "typed"), [("--speed", "-120 rpm"), ("--speed", "0 rpm"), ("--rop", "-1 ft/h")]
)
def test_what_was_typed_is_named_in_its_own_units(capsys, option, typed):
    point = {"--rig": "table1", "--speed": "120 rpm", "--rop": "20 m/h", option: typed}
    with pytest.raises(SystemExit) as stop:
        cli.main(["analyze", *(word for pair in point.items() for word in pair)])
    assert stop.value.code == 2
    assert f"{option} = {typed}: must be" in capsys.readouterr().err
