import copy
import csv
import json
import pickle
import struct
import tracemalloc
import zlib

import numpy as np
import pandas
import pyarrow.parquet
import pytest
import scipy.interpolate
import scipy.io
import xarray

from drillctrl import InputError, load_table, save_table
from drillctrl.tables.document import checksum, to_document
from drillctrl.tables.files import ENDINGS


def assert_same(one, two):
    assert one.grid == two.grid
    columns = ("spectral_abscissa", "abscissa_error", "stable", "certified", "best_abscissa")
    for name in ("gains", *columns):
        assert np.array_equal(getattr(one, name), getattr(two, name)), name
    for name in ("mode", "spectral_abscissa", "gains"):
        assert np.array_equal(getattr(one.cells, name), getattr(two.cells, name)), name
    assert one.structure.name == two.structure.name
    assert np.array_equal(one.structure.upper, two.structure.upper)
    assert (one.give_up, one.fallback, one.seed) == (two.give_up, two.fallback, two.seed)


@pytest.mark.long(but=1)
@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("which", ["small", "on_rig"])
def test_round_trip_is_exact_and_bytes_repeat(ending, which, request, tmp_path):
    given = request.getfixturevalue(which)
    first, second = tmp_path / f"a{ending}", tmp_path / f"b{ending}"
    save_table(given, first)
    loaded = load_table(first)
    assert_same(given, loaded)
    save_table(loaded, second)
    assert first.read_bytes() == second.read_bytes()


def test_csv_as_others_read_it(on_rig, tmp_path):
    path = tmp_path / "t.csv"
    save_table(on_rig, path)
    lines = path.read_text().splitlines()
    header = dict(line[2:].split(": ", 1) for line in lines if line.startswith("#"))
    assert {"units", "sign_convention", "sample_time", "structure", "reference", "checksum"} <= set(
        header
    )
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    names = [
        "omega0",
        "delta0",
        "psi",
        "K1_1",
        "K1_2",
        "K2_1",
        "K2_2",
        "spectral_abscissa",
        "stable",
    ]
    assert list(rows[0])[:9] == names
    assert float(rows[-1]["K1_2"]) == on_rig.entries[-1, 1]
    rig = on_rig.grid.rig
    expected = float(rows[-1]["K1_2"]) * rig.torsional_stiffness * rig.time_scale
    assert float(rows[-1]["K1_2_rig"]) == pytest.approx(expected, rel=1e-12)
    assert json.loads(header["units"])["K1_2_rig"] == "N*m*s/rad"
    point = on_rig.grid.points[-1]
    assert float(rows[-1]["delay_s"]) == pytest.approx(point.delay * rig.time_scale, rel=1e-12)


def test_other_tools_open_the_files(small, tmp_path):
    for ending in (".parquet", ".mat", ".nc"):
        save_table(small, tmp_path / f"t{ending}")
    frame = pyarrow.parquet.read_table(tmp_path / "t.parquet")
    assert frame["K1_1"].to_pylist() == small.entries[:, 0].tolist()
    assert frame["stable"].to_pylist() == small.stable.tolist()
    mat = scipy.io.loadmat(tmp_path / "t.mat")
    assert mat["K2_1"].ravel().tolist() == small.entries[:, 1].tolist()
    with xarray.open_dataset(tmp_path / "t.nc", engine="scipy") as data:
        assert data["K1_1"].dims == ("omega0", "delta0", "psi")
        near = data["K1_1"].sel(omega0=11.0, delta0=3.5, psi=14.0).item()
        assert near == small.entries[4, 0]
        assert data.attrs["Conventions"] == "CF-1.8"


def refuse(path):
    with pytest.raises(InputError) as caught:
        load_table(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("ending", ENDINGS)
def test_truncated_or_foreign_files_are_refused(ending, small, tmp_path):
    path = tmp_path / f"t{ending}"
    save_table(small, path)
    whole = path.read_bytes()
    for share in (0.0, 0.3, 0.9):
        path.write_bytes(whole[: int(share * len(whole))])
        refuse(path)
    path.write_bytes(pickle.dumps(small.gains))
    refuse(path)
    path.write_bytes(b"\x00" * 1000)
    refuse(path)


def test_changed_numbers_are_refused(small, tmp_path):
    path = tmp_path / "t.csv"
    save_table(small, path)
    text = path.read_text()
    rows = [line for line in text.splitlines() if not line.startswith("#")]
    fields = rows[1].split(",")
    changed = ",".join([*fields[:3], repr(float(fields[3]) + 1e-9), *fields[4:]])
    path.write_text(text.replace(rows[1], changed))
    assert "checksum" in refuse(path)
    path.write_text(text.replace(rows[1], ",".join([*fields[:3], "nan", *fields[4:]])))
    assert "not finite" in refuse(path)
    path.write_text(text.replace(rows[1] + "\n", ""))
    assert "announced" in refuse(path)


def test_huge_announcements_are_refused_before_anything_is_read(small, tmp_path):
    document = to_document(small)
    header = {**document.header, "axes": {"omega0": list(range(40_000)),
              "delta0": list(range(40_000)), "psi": [14.0]}}  # fmt: skip
    header["checksum"] = checksum(header, document.columns)
    path = tmp_path / "t.json"
    columns = {name: values.tolist() for name, values in document.columns.items()}
    path.write_text(json.dumps({**header, "columns": columns}))
    assert "1600000000 rows announced" in refuse(path)


def forged(table, path, *, columns=None, **header):
    """Write a JSON file whose checksum is right, whatever it says."""
    document = to_document(table)
    columns = {**document.columns, **(columns or {})}
    header = {**copy.deepcopy(document.header), **header}
    header["checksum"] = checksum(header, columns)
    lists = {name: values.tolist() for name, values in columns.items()}
    path.write_text(json.dumps({**header, "columns": lists}))
    return path


def test_forging_itself_is_not_what_is_refused(small, on_rig, tmp_path):
    for table in (small, on_rig):
        assert_same(table, load_table(forged(table, tmp_path / "t.json")))


@pytest.mark.parametrize(
    ("column", "value", "reason"),
    [
        ("K1_1", np.nan, "K1_1 that is not finite"),
        ("K1_1", 10.1, "gains outside their bounds"),
        ("omega0", 7.0, "omega0 that does not follow"),
        ("spectral_abscissa", 0.1, "stable node with a positive"),
        ("stable", 0.0, "vouched for with a node that is not"),
    ],
)
def test_senseless_numbers_with_a_right_checksum_are_refused(
    column, value, reason, small, tmp_path
):
    values = to_document(small).columns[column].copy()
    values[4] = value
    assert reason in refuse(forged(small, tmp_path / "t.json", columns={column: values}))


def test_columns_of_the_rig_follow_from_the_others(on_rig, tmp_path):
    for name in ("K1_2_rig", "delay_s", "rotary_speed", "psi"):
        values = 1.001 * to_document(on_rig).columns[name]
        path = forged(on_rig, tmp_path / "t.json", columns={name: values})
        assert f"{name} that does not follow" in refuse(path)


@pytest.mark.parametrize(
    ("part", "change", "reason"),
    [
        ("structure", {"outputs": ["theta"] * 40_000}, "outputs"),
        ("structure", {"outputs": ["*/ int x; /*"]}, "outputs"),
        ("structure", {"inputs": ["brake"]}, "inputs"),
        ("structure", {"name": "two\nlines"}, "a structure named"),
        ("structure", {"K1_lower": [[5.0]], "K1_upper": [[-5.0]]}, "lower"),
        ("cells", {"mode": [0.9] * 4}, "cells that do not fit"),
        ("cells", {"mode": [1] * 4}, "constant gains"),
        ("cells", {"mode": [3] * 4}, "cells that do not fit"),
        ("cells", {"gains": {"-1": [1.0, 1.0]}}, "constant gains"),
        ("cells", {"spectral_abscissa": [0.1] * 4}, "cell that is vouched for with a positive"),
        ("reference", {"kind": "recipe"}, "recipe"),
        ("units", {"K1_1": "N"}, "other columns or units"),
    ],
)
def test_senseless_headers_with_a_right_checksum_are_refused(part, change, reason, small, tmp_path):
    header = {part: {**to_document(small).header[part], **change}}
    assert reason in refuse(forged(small, tmp_path / "t.json", **header))


@pytest.mark.parametrize(
    ("name", "value"),
    [("give_up", 7.0), ("seed", -1), ("fallback", "hope"), ("objective", 3), ("schema", "x")],
)
def test_senseless_settings_are_refused(name, value, small, tmp_path):
    refuse(forged(small, tmp_path / "t.json", **{name: value}))


def test_more_columns_than_announced_are_refused(small, tmp_path):
    extra = {f"x{i}": np.zeros(9) for i in range(300)}
    assert "columns" in refuse(forged(small, tmp_path / "t.json", columns=extra))
    save_table(small, tmp_path / "t.parquet")
    frame = pyarrow.parquet.read_table(tmp_path / "t.parquet")
    pyarrow.parquet.write_table(frame.append_column("x", frame["psi"]), tmp_path / "t.parquet")
    assert "columns that were not announced" in refuse(tmp_path / "t.parquet")


def test_deep_nesting_is_refused(tmp_path):
    path = tmp_path / "t.json"
    path.write_text('{"schema":' + "[" * 100_000 + "]" * 100_000 + "}")
    refuse(path)


def matlab_file(path, table, **options):
    document = to_document(table)
    fields = {name: values[:, None] for name, values in document.columns.items()}
    fields["header"] = json.dumps(document.header)
    scipy.io.savemat(path, {**fields, **options.pop("fields", {})}, **options)
    return path


def test_other_matlab_files_are_refused(small, tmp_path):
    path = tmp_path / "t.mat"
    assert_same(small, load_table(matlab_file(path, small)))
    assert_same(small, load_table(matlab_file(path, small, do_compression=True)))
    gains = to_document(small).columns["K1_1"][:, None]
    for wrong in (gains + 1j, gains.T, gains.astype(np.float32), "text", {"a": gains}):
        refuse(matlab_file(path, small, fields={"K1_1": wrong}))
    refuse(matlab_file(path, small, fields={"more": gains}))
    refuse(matlab_file(path, small, format="4"))


def test_matlab_interpolates_the_arrays_as_they_are(small, on_rig, tmp_path):
    rng = np.random.default_rng(2)
    for table in (small, on_rig):
        path = tmp_path / "t.mat"
        save_table(table, path)
        mat = scipy.io.loadmat(path)
        axes = [axis.ravel() for axis in mat["axes"].ravel()]
        shape = [len(axis.values) for axis in table.grid.axes if len(axis.values) > 1]
        assert [axis.size for axis in axes] == list(mat["K1_1"].shape) == shape
        for axis in table.grid.axes:
            assert mat[f"axis_{axis.name}"].ravel().tolist() == list(axis.values)
        gains = scipy.interpolate.RegularGridInterpolator(axes, mat["K1_1"])
        low, high = table.grid.coordinates.min(axis=0), table.grid.coordinates.max(axis=0)
        places = low + (high - low) * rng.random((20, 3))
        K1, _ = table.gains_at(*table.grid.groups(places).T)
        # Where no cell has constant gains of its own.
        plain = np.full(len(places), not (table.cells.mode == 1).any())
        found = gains(places[:, [len(axis.values) > 1 for axis in table.grid.axes]])
        assert plain.any()
        assert found == pytest.approx(K1[:, 0, 0].tolist(), rel=1e-12)


@pytest.mark.parametrize("compressed", [False, True])
def test_a_matlab_file_saved_anew_loads_again(small, on_rig, tmp_path, compressed):
    for table in (small, on_rig):
        path = tmp_path / "t.mat"
        save_table(table, path)
        read = {k: v for k, v in scipy.io.loadmat(path).items() if k[:2] != "__"}
        # MATLAB sorts by name.
        scipy.io.savemat(path, dict(sorted(read.items())), do_compression=compressed)
        assert_same(table, load_table(path))


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)


def test_whole_numbers_in_few_bytes_and_texts_of_two_are_read(small, tmp_path):
    """As MATLAB saves them."""
    path = tmp_path / "t.mat"
    save_table(small, path)
    document = to_document(small)
    parts = [path.read_bytes()[:128]]
    for name, values in {**document.columns, "header": json.dumps(document.header)}.items():
        if name == "header":
            flags, kind, data = 4, 4, values.encode("utf-16-le")
            shape = (1, len(values))
        else:
            whole = bool((values == values.astype(np.uint8)).all())
            grid = values.reshape(3, 3).ravel(order="F")
            flags, kind, data = 6, *((2, grid.astype("u1")) if whole else (9, grid))
            data, shape = data.tobytes(), (3, 3)
        matrix = b"".join(
            (
                element(6, struct.pack("<II", flags, 0)),
                element(5, struct.pack("<ii", *shape)),
                element(1, name.encode()),
                element(kind, data),
            )
        )
        packed = zlib.compress(element(14, matrix))
        parts.append(struct.pack("<II", 15, len(packed)) + packed)
    path.write_bytes(b"".join(parts))
    assert_same(small, load_table(path))


def test_a_matlab_7_3_file_is_refused_with_the_way_out(small, tmp_path):
    path = tmp_path / "t.mat"
    save_table(small, path)
    whole = bytearray(path.read_bytes())
    whole[124:128] = b"\x00\x02IM"
    path.write_bytes(whole)
    assert "'-v7'" in refuse(path)
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(whole))
    assert "'-v7'" in refuse(path)


def test_a_small_file_that_unpacks_to_a_lot_is_refused(small, tmp_path):
    path = tmp_path / "t.mat"
    save_table(small, path)
    read = {k: v for k, v in scipy.io.loadmat(path).items() if k[:2] != "__"}
    scipy.io.savemat(path, {**read, "K1_1": np.zeros((4000, 4000))}, do_compression=True)
    assert path.stat().st_size < 200_000
    tracemalloc.start()
    assert "K1_1" in refuse(path) or "larger" in refuse(path)
    assert tracemalloc.get_traced_memory()[1] < 20e6
    tracemalloc.stop()


def test_parquet_through_pandas_loads_again_or_says_what_to_write(small, on_rig, tmp_path):
    path = tmp_path / "t.parquet"
    for table in (small, on_rig):
        save_table(table, path)
        frame = pandas.read_parquet(path)
        frame.to_parquet(path)
        assert_same(table, load_table(path))
    frame.attrs = {}
    frame.to_parquet(path)
    assert "with its attrs" in refuse(path)


def test_csv_in_the_units_of_the_rig(on_rig, tmp_path):
    path = tmp_path / "t.csv"
    save_table(on_rig, path)
    lines = path.read_text().splitlines()
    header = dict(line[2:].split(": ", 1) for line in lines if line.startswith("#"))
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert float(rows[0]["rotary_speed_rpm"]) == pytest.approx(100.0, rel=1e-12)
    assert float(rows[-1]["penetration_rate_m_per_h"]) == pytest.approx(60.0, rel=1e-12)
    strength = on_rig.grid.rig.rock_strength
    assert float(rows[0]["rock_strength_MPa"]) == pytest.approx(strength / 1e6, rel=1e-12)
    plain = json.loads(header["dimensionless"])
    assert {"omega0", "delta0", "psi", "K1_1", "spectral_abscissa"} <= set(plain)
    assert not {"delay_s", "K1_1_rig"} & set(plain)
    # A change of what is shown in units of the rig is seen as well.
    path.write_text(path.read_text().replace(rows[0]["rotary_speed_rpm"], "101.0"))
    assert "does not follow" in refuse(path)
    # Files of earlier versions have their axes in SI.
    si = to_document(on_rig)
    text = [f"# {k}: {json.dumps(v)}" for k, v in si.header.items()] + [",".join(si.columns)]
    text += [
        ",".join(map(repr, row)) for row in np.column_stack(list(si.columns.values())).tolist()
    ]
    path.write_text("\n".join(text) + "\n")
    assert_same(on_rig, load_table(path))


def test_a_matlab_file_with_any_byte_changed_is_refused_or_the_same(small, tmp_path):
    path = tmp_path / "t.mat"
    save_table(small, path)
    whole = path.read_bytes()
    rng = np.random.default_rng(1)
    places = [*range(116, 700), *rng.integers(700, len(whole), 200).tolist()]
    for place, value in zip(places, rng.choice([0, 8, 255], len(places)).tolist(), strict=True):
        changed = bytearray(whole)
        changed[place] = value
        path.write_bytes(changed)
        try:
            assert_same(small, load_table(path))
        except InputError as error:
            assert "\n" not in str(error)


def test_unknown_endings_and_missing_files(small, tmp_path):
    for name in ("t.pkl", "t", "t.npz"):
        with pytest.raises(InputError):
            save_table(small, tmp_path / name)
    assert "No such file" in refuse(tmp_path / "none.csv")
