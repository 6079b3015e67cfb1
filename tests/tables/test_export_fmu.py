import ctypes
import re
import subprocess
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

from drillctrl import Controller, InputError, OperatingPoint, simulate
from drillctrl.tables.export_fmu import export_fmu

from .exported import FLAGS, InC

POINT = OperatingPoint(10.0, 2.5, 14.0)
PERIOD, LIMIT = POINT.delay / 16, 3.0
VERSIONS = ("2.0", "3.0")
AT = (10.0, 2.5, 14.0)


@pytest.fixture(params=VERSIONS)
def version(request):
    return request.param


@pytest.fixture
def unit(small, tmp_path, version):
    return export_fmu(
        small, tmp_path / "drill.fmu", period=PERIOD, limit=LIMIT, ramp=0, fmi=version
    )


class Slave:
    """An instance in fmpy, by the names of variables."""

    def __init__(self, unit, name="one"):
        description = fmpy.read_model_description(str(unit))
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.newer = description.fmiVersion == "3.0"
        self.slave = (FMU3Slave if self.newer else FMU2Slave)(
            guid=description.guid,
            unzipDirectory=fmpy.extract(str(unit)),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.slave.instantiate()
        self.begin()

    def begin(self, start=0.0):
        if self.newer:
            self.slave.enterInitializationMode(startTime=start)
        else:
            self.slave.setupExperiment(startTime=start)
            self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        self.time = start

    def set(self, **values):
        reals = self.slave.setFloat64 if self.newer else self.slave.setReal
        for name, value in values.items():
            put = self.slave.setBoolean if isinstance(value, bool) else reals
            put([self.references[name]], [value])

    def get(self, name, kind=None):
        newer, older = ("Int32", "Integer") if kind is int else ("Float64", "Real")
        return getattr(self.slave, f"get{newer if self.newer else older}")([self.references[name]])[
            0
        ]

    def step(self, theta, at=AT, delay=POINT.delay, on=True, *, time=None, length=PERIOD):
        self.set(theta=theta, delay=delay, enable=on)
        self.set(**dict(zip(("omega0", "delta0", "psi"), at, strict=True)))
        start = self.time if time is None else time
        self.slave.doStep(currentCommunicationPoint=start, communicationStepSize=length)
        self.time = start + length
        return self.get("u")


def test_the_unit_is_valid_and_says_what_it_is(small, on_rig, tmp_path, version):
    for table, name in ((small, "plain"), (on_rig, "rig")):
        path = tmp_path / f"{name}.fmu"
        export_fmu(table, path, period=0.01, limit=500.0, fmi=version)
        assert validate_fmu(str(path)) == []
        description = fmpy.read_model_description(str(path))
        known = {v.name: v for v in description.modelVariables}
        rig = table.grid.rig is not None
        for axis in table.grid.axes:
            assert known[axis.name].unit == (axis.unit if axis.unit != "1" else None)
            ends = float(known[axis.name].min), float(known[axis.name].max)
            assert ends == pytest.approx((axis.values[0], axis.values[-1]), rel=1e-8)
        assert known["u"].unit == ("N.m" if rig else None)
        assert (float(known["limit"].max), known["limit"].causality) == (500.0, "parameter")
        with zipfile.ZipFile(path) as archive:
            text = archive.read("modelDescription.xml").decode()
            files = set(archive.namelist())
        assert {f"sources/{name}.c", f"sources/{name}.h", f"sources/{name}_fmu.c"} <= files
        assert sum(file.startswith("binaries/") for file in files) == 1
        sound = int(table.sound.sum())
        assert "have not been tried" in text
        assert f"{sound} of {len(table.gains)} vouched for" in text
        again = tmp_path / f"again/{name}.fmu"
        again.parent.mkdir(exist_ok=True)
        export_fmu(table, again, period=0.01, limit=500.0, fmi=version)
        one, two = (zipfile.ZipFile(file).read("modelDescription.xml") for file in (path, again))
        assert one == two
    if rig:
        units = ElementTree.fromstring(text).find("UnitDefinitions")
        speed = next(u for u in units if u.get("name") == "rad/s")
        assert float(speed.find("DisplayUnit").get("factor")) == pytest.approx(60 / (2 * np.pi))


def test_same_command_as_the_simulator_over_a_stick_slip_transient(small, unit):
    K1, K2 = small.gains_at(*AT)
    start = 100.0
    control = Controller("case1", K1[0], K2[0], activation=start, period=PERIOD, limit=LIMIT)
    run = simulate(POINT, control, duration=130.0, initial={"dx": 1.0, "dtheta": 1.0})
    assert any(event.name == "stick" for event in run.events)
    samples = np.arange(-100, int(29.0 / PERIOD))
    theta = run.at(start + samples * PERIOD).theta
    held = run.at(start + (samples + 0.5) * PERIOD).torque
    slave = Slave(unit)
    u = [slave.step(y, on=k >= 0) for k, y in zip(samples.tolist(), theta.tolist(), strict=True)]
    assert np.abs(held - u).max() < 1e-12
    assert np.abs(held).max() == LIMIT
    assert slave.get("status", int) in (0, 128)
    # By fmpy's own loop too, whose outputs stand behind each step.
    kinds = [(name, "f8") for name in ("time", "theta", "omega0", "delta0", "psi", "delay")]
    rows = np.zeros(len(samples), [*kinds, ("other", "f8"), ("enable", "?")])
    rows["time"], rows["theta"], rows["enable"] = (samples + 100) * PERIOD, theta, samples >= 0
    rows["omega0"], rows["delta0"], rows["psi"] = AT
    rows["delay"] = POINT.delay
    result = fmpy.simulate_fmu(
        str(unit), start_time=0.0, stop_time=rows["time"][500], step_size=PERIOD,
        output_interval=PERIOD, input=rows, output=["u"],
    )  # fmt: skip
    # Discrete inputs count from a step on or from the one before, by fmpy's version.
    found, count = result["u"][2:], len(result) - 2
    lags = [np.abs(found - held[lag : lag + count]).max() for lag in (0, 1)]
    assert min(lags) < 1e-9 < max(lags)


def test_instances_are_apart_and_are_reset_saved_and_restored(unit):
    signal = (0.05 * np.sin(0.1 * np.arange(60))).tolist()
    one, two = Slave(unit), Slave(unit, "two")
    first = [one.step(y) for y in signal]
    assert two.get("u") == 0.0
    assert [two.step(y) for y in signal] == first
    # A state is taken back, by itself and through its bytes, into another instance too.
    newer = one.newer
    take = one.slave.getFMUState if newer else one.slave.getFMUstate
    state = take()
    later = [one.step(y) for y in signal]
    assert later != first
    (one.slave.setFMUState if newer else one.slave.setFMUstate)(state)
    one.time = two.time
    assert [one.step(y) for y in signal] == later
    data = (one.slave.serializeFMUState if newer else one.slave.serializeFMUstate)(state)
    if newer:
        two.slave.setFMUState(two.slave.deserializeFMUState(data))
    else:
        two.slave.setFMUstate(two.slave.deSerializeFMUstate(data))
    assert [two.step(y) for y in signal] == later
    one.slave.reset()
    one.begin()
    assert [one.step(y) for y in signal] == first


def test_a_clock_that_runs_back_a_tighter_limit_and_odd_steps(small, unit, tmp_path):
    slave = Slave(unit)
    signal = (0.05 * np.sin(0.1 * np.arange(60))).tolist()
    reference = InC(small, tmp_path, period=PERIOD, limit=LIMIT, ramp=0)
    for y in signal:
        assert slave.step(y) == reference.step([y], AT, POINT.delay)
    slave.step(0.01, time=slave.time - 5 * PERIOD)
    assert slave.get("status", int) == 2 + 16
    slave.set(limit=0.25)
    assert {abs(slave.step(5.0)) for _ in range(30)} >= {0.25}
    for length in (0.5 * PERIOD, 1.5 * PERIOD, 0.0, -PERIOD, float("nan")):
        with pytest.raises(Exception, match="rror"):
            slave.step(0.0, length=length)
    slave.step(0.0, length=3 * PERIOD)
    with pytest.raises(Exception, match="rror"):
        slave.set(u=1.0)


@pytest.mark.long(but=1)
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_declarations_are_those_of_the_standard(unit, tmp_path, version, compiler, tool):
    """The source compiles alone and with the standard's headers, no warning either way."""
    tool(compiler)
    with zipfile.ZipFile(unit) as archive:
        archive.extractall(tmp_path)
    headers = Path(fmpy.__file__).parent / "c-code"
    standard = (f"-isystem{headers}", f"-includefmi{version[0]}Functions.h", "-DWITH_FMI_HEADERS")
    for extra in ((), standard):
        for file in ("drill.c", "drill_fmu.c"):
            source = tmp_path / "sources" / file
            command = [compiler, *FLAGS, *extra, "-c", str(source), "-o", str(tmp_path / "t.o")]
            run = subprocess.run(command, capture_output=True, text=True, check=False)
            assert run.returncode == 0, run.stderr
    binary = next((tmp_path / "binaries").rglob("drill.*"))
    library = ctypes.CDLL(str(binary))
    assert not hasattr(library, "drill_step")
    header = (headers / f"fmi{version[0]}Functions.h").read_text()
    names = set(re.findall(rf"\b(fmi{version[0]}[A-Z]\w+)TYPE\b", header))
    assert len(names) > 20
    assert [name for name in names if not hasattr(library, name)] == []


def test_what_cannot_be_made_is_refused(small, tmp_path, monkeypatch):
    given = {"period": PERIOD, "limit": LIMIT}
    for wrong, name in (({"fmi": "1.0"}, "drill"), ({}, "1x"), ({"period": 0.0}, "drill")):
        with pytest.raises(InputError):
            export_fmu(small, tmp_path / f"{name}.fmu", **{**given, **wrong})
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(InputError, match="where a C compiler is"):
        export_fmu(small, tmp_path / "drill.fmu", **given)
    assert not list(tmp_path.iterdir())
