import subprocess

import numpy as np
import pytest

from drillctrl import Controller, InputError, OperatingPoint, simulate
from drillctrl.tables.export_c import export_c

from .exported import FLAGS, InC

POINT = OperatingPoint(10.0, 2.5, 14.0)
# A sixteenth of the delay, so that the delayed output is a sample.
PERIOD, LIMIT = POINT.delay / 16, 3.0


def compiled_of(table, folder, real="double", **options):
    return InC(table, folder, real=real, period=PERIOD, limit=LIMIT, **{"ramp": 0, **options})


def test_lookup_equals_python(small, on_rig, tmp_path):
    rng = np.random.default_rng(3)
    for table in (small, on_rig):
        compiled = compiled_of(table, tmp_path)
        low, high = table.grid.coordinates.min(axis=0), table.grid.coordinates.max(axis=0)
        places = low + (high - low) * rng.uniform(-0.3, 1.3, (200, 3))
        places[:, 2] = low[2]
        for place, groups in zip(places, table.grid.groups(np.abs(places)), strict=True):
            if (place <= 0).any():
                continue
            K1, K2 = table.gains_at(*groups)
            gains, vouched = compiled.lookup(place)
            expected = np.array([*K1.ravel(), *K2.ravel()])
            rig = table.grid.rig
            if rig is not None:
                # N·m/rad and N·m·s/rad
                expected *= rig.torsional_stiffness * np.array([1.0, rig.time_scale] * 2)
            assert gains == pytest.approx(expected.tolist(), rel=1e-10, abs=1e-9)
            assert vouched == table.stable_at(*groups)[0]


def test_same_command_as_the_simulator_over_a_stick_slip_transient(small, tmp_path):
    K1, K2 = small.gains_at(10.0, 2.5, 14.0)
    start = 100.0
    control = Controller("case1", K1[0], K2[0], activation=start, period=PERIOD, limit=LIMIT)
    run = simulate(POINT, control, duration=130.0, initial={"dx": 1.0, "dtheta": 1.0})
    assert any(event.name == "stick" for event in run.events)
    samples = np.arange(-100, int(29.0 / PERIOD))
    theta = run.at(start + samples * PERIOD).theta
    held = run.at(start + (samples + 0.5) * PERIOD).torque
    compiled = compiled_of(small, tmp_path)
    commanded = [
        compiled.step([y], (10.0, 2.5, 14.0), POINT.delay, int(k >= 0))
        for k, y in zip(samples.tolist(), theta.tolist(), strict=True)
    ]
    assert np.abs(held - commanded).max() < 1e-12
    assert np.abs(held).max() == LIMIT
    assert np.ptp(held[-500:]) > 1e-9


def test_float_soft_start_and_switching(small, tmp_path):
    compiled = compiled_of(small, tmp_path, real="float", ramp=10)
    at, delay = (10.0, 2.5, 14.0), POINT.delay
    off = [compiled.step([0.1], at, delay, 0) for _ in range(50)]
    on = [compiled.step([0.1], at, delay, 1) for _ in range(20)]
    K1, K2 = small.gains_at(*at)
    full = 0.1 * (K1.item() + K2.item())
    assert off == [0.0] * 50
    assert on[:10] == pytest.approx([full * (i + 1) / 10 for i in range(10)], rel=1e-5)
    assert on[10:] == pytest.approx([full] * 10, rel=1e-5)
    compiled.init()
    driven = [compiled.step([1e9], at, delay) for _ in range(10)]
    assert driven[-1] == pytest.approx(np.sign(K1.item()) * LIMIT)


def test_by_default_it_is_switched_on_over_a_delay(small, tmp_path):
    compiled = compiled_of(small, tmp_path, ramp=None)
    longest = max(point.delay for point in small.grid.points)
    samples = int(longest / PERIOD)
    for _ in range(100):
        compiled.step([0.1], (8.0, 2.0, 14.0), longest, 0)
    on = [compiled.step([0.1], (8.0, 2.0, 14.0), longest) for _ in range(samples + 5)]
    assert on[0] == pytest.approx(on[-1] / samples)
    assert np.argmax(np.isclose(on, on[-1], rtol=1e-12)) == samples - 1


def test_the_state_says_whether_the_table_vouches(small, tmp_path):
    compiled = compiled_of(small, tmp_path)
    for at, on in (((10.0, 2.0, 14.0), 1), ((10.0, 20.0, 14.0), 1), ((9.0, 5.0, 14.0), 0)):
        compiled.step([0.1], at, POINT.delay, on)
        assert compiled.vouched == small.stable_at(*at)[0]


def test_a_header_of_another_table_is_not_compiled(small, tmp_path):
    header, source = export_c(small, tmp_path, period=PERIOD, limit=LIMIT)
    command = ["gcc", *FLAGS, "-c", str(source), "-o", str(tmp_path / "t.o")]
    assert subprocess.run(command, check=False).returncode == 0
    before = header.read_text()
    export_c(small, tmp_path, period=PERIOD, limit=2 * LIMIT)
    header.write_text(before)
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "different tables" in run.stderr


def test_a_header_of_someone_else_is_left_alone(small, tmp_path):
    (tmp_path / "gain_table.h").write_text("/* mine */")
    with pytest.raises(InputError, match="it is not ours"):
        export_c(small, tmp_path, period=PERIOD, limit=LIMIT)
    assert (tmp_path / "gain_table.h").read_text() == "/* mine */"
    assert len(list(tmp_path.iterdir())) == 1


def test_header_says_what_it_holds_and_bad_input_is_refused(small, tmp_path):
    compiled = compiled_of(small, tmp_path)
    for word in ("SHA-256", "omega0 (1)", "theta", "K1_1 -10..10", "eta 1.6", "2 pi/(4 omega0)"):
        assert word in compiled.header
    for wrong in ({"name": "1x"}, {"period": 0.0}, {"limit": -1.0}, {"real": "half"}):
        with pytest.raises(InputError):
            export_c(small, tmp_path, **{"name": "t", "period": 0.1, "limit": 1.0, **wrong})
