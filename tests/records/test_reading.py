"""Recordings as they come: names, units, signs, stamps, gaps; and one line for what is damaged."""

import datetime as dt
import io
import itertools

import numpy as np
import pytest
import scipy.io

from drillctrl import InputError, read_record
from drillctrl.records.columns import quantity_of

COUNT, STEP = 400, 0.05
TIME = STEP * np.arange(COUNT)
RPM = 120.0 + 5.0 * np.sin(2.0 * np.pi * 0.2 * TIME)
TORQUE = 8.0 + 2.0 * np.cos(2.0 * np.pi * 0.2 * TIME)


def rows(header, *columns, separator=",", line="\n"):
    cells = zip(*columns, strict=True)
    return line.join([separator.join(header), *(separator.join(row) for row in cells)]) + line


def texts(values, digits=4):
    return [f"{value:.{digits}f}" for value in values]


def plain(header=("Time [s]", "RPM [rpm]", "Torque [kN.m]")):
    return rows(header, texts(TIME, 2), texts(RPM), texts(TORQUE))


def stamps(zone="+01:00", start=dt.datetime(2026, 3, 1, 23, 59, 50)):
    return [
        (start + dt.timedelta(seconds=t)).isoformat(timespec="milliseconds") + zone for t in TIME
    ]


def read(tmp_path, text, columns=(), name="record.csv", encoding="utf-8", **options):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding) if isinstance(text, str) else text)
    return read_record(path, columns, **options)


def check(record, torque=1e3 * TORQUE):
    assert record.step == pytest.approx(STEP, rel=1e-6)
    np.testing.assert_allclose(record.values["rotary_speed"], RPM * np.pi / 30.0, rtol=1e-5)
    np.testing.assert_allclose(record.values["torque"], torque, rtol=1e-4)


def test_headers_separators_signs_and_encodings(tmp_path):
    check(read(tmp_path, plain()))
    comma = plain().replace(",", ";").replace(".", ",").replace("kN,m", "kN·m")
    check(read(tmp_path, comma))
    check(read(tmp_path, comma, encoding="utf-16"))
    check(read(tmp_path, comma.replace("·", "\N{MIDDLE DOT}"), encoding="cp1252"))
    check(read(tmp_path, plain().replace(",", "\t"), name="record.txt"))
    spaced = plain(("time_s", "Rotary_RPM", "torque_kNm")).replace(",", "   ")
    check(read(tmp_path, spaced, name="record.txt"))
    check(
        read(tmp_path, "Well 7\nRig A, night shift\n# a remark\n" + plain().replace("\n", "\r\n"))
    )
    row_of_units = rows(
        ("TIME", "TDRPM", "STOR"), ["s", *texts(TIME, 2)], ["rpm", *texts(RPM)],
        ["kN.m", *texts(TORQUE)],
    )  # fmt: skip
    check(read(tmp_path, row_of_units))


def test_units_in_cells_and_thousands_that_tell_themselves(tmp_path):
    newtons = [f"{1e3 * value:,.2f}" for value in TORQUE]
    header = ("Time [s]", "RPM", "Torque [N.m]")
    turns = [f"{value:.4f} rpm" for value in RPM]
    check(read(tmp_path, rows(header, texts(TIME, 2), turns, [f'"{cell}"' for cell in newtons])))
    swapped = [cell.translate(str.maketrans(",.", ".,")) for cell in newtons]
    times = [cell.replace(".", ",") for cell in texts(TIME, 2)]
    turns = [f"{value:.4f}".replace(".", ",") for value in RPM]
    told = ("Time [s]", "RPM [rpm]", "Torque [N.m]")
    check(read(tmp_path, rows(told, times, turns, swapped, separator=";")))
    mixed = [f"{value:.4f} {'Hz' if k == 7 else 'rpm'}" for k, value in enumerate(RPM)]
    with pytest.raises(InputError, match="RPM, row 1"):
        read(tmp_path, rows(header, texts(TIME, 2), mixed, texts(TORQUE)))


def test_field_units_and_what_the_user_says(tmp_path):
    pounds = TORQUE * 1e3 / 1355.8179483314
    text = rows(("A", "B", "C [unknown]"), texts(TIME, 2), texts(RPM), texts(pounds, 6))
    told = ["time=A [s]", "rotary_speed=B [rpm]", "torque=C [kft.lbf]"]
    record = read(tmp_path, text, told)
    check(record)
    assert [t.column for t in record.taken] == ["A", "B", "C [unknown]"]
    assert record.taken[2].unit == "kft.lbf"


def test_stamps_with_zones_and_clocks(tmp_path):
    header = ("Timestamp", "RPM", "Torque [kN.m]")
    record = read(tmp_path, rows(header, stamps(), texts(RPM), texts(TORQUE)))
    check(record)
    assert record.start == "2026-03-01T22:59:50+00:00"
    slashed = [
        f"{s[5:7]}/{s[8:10]}/{s[:4]} {s[11:23]}" for s in stamps("", dt.datetime(2026, 3, 14))
    ]
    record = read(tmp_path, rows(header, slashed, texts(RPM), texts(TORQUE)))
    assert record.start == "2026-03-14T00:00:00+00:00"
    slashed = [stamp.replace("/14/", "/04/") for stamp in slashed]
    with pytest.raises(InputError, match="day-first or --dates month-first"):
        read(tmp_path, rows(header, slashed, texts(RPM), texts(TORQUE)))
    record = read(tmp_path, rows(header, slashed, texts(RPM), texts(TORQUE)), dates="day-first")
    assert record.start.startswith("2026-04-03")
    # Over midnight, the date in a column of its own or nowhere.
    clocks = [s[11:23] for s in stamps("")]
    check(read(tmp_path, rows(header, clocks, texts(RPM), texts(TORQUE))))
    days = [s[:10] for s in stamps("")]
    both = rows(("Date", "Time", *header[1:]), days, clocks, texts(RPM), texts(TORQUE))
    check(read(tmp_path, both))


def test_rows_that_repeat_return_or_are_missing(tmp_path):
    lines = plain().splitlines()
    repeated = [lines[0], *lines[1:200], *lines[190:]]
    record = read(tmp_path, "\n".join(repeated))
    check(record)
    assert any("sorted by time" in note for note in record.notes)
    check(read(tmp_path, "\n".join([lines[0], *lines[:0:-1]])))
    # In reverse but for three rows; and a column that is no time.
    nearly = [lines[0], *lines[:200:-1], *lines[198:201], *lines[197:0:-1]]
    record = read(tmp_path, "\n".join(nearly))
    check(record)
    assert "the rows stood in reverse and were turned round" in record.notes
    assert "time went back at 2 rows; rows were sorted by time" in record.notes
    with pytest.raises(InputError, match="Are these times"):
        read(
            tmp_path,
            rows(
                ("Time [s]", "RPM", "TQ [kNm]"),
                texts((17 * np.arange(COUNT)) % 40, 0),
                texts(RPM),
                texts(TORQUE),
            ),
        )
    record = read(tmp_path, "\n".join([*lines[:101], *lines[161:]]))
    known = np.isfinite(record.values["torque"])
    assert known.sum() == pytest.approx(COUNT - 60, abs=2)
    np.testing.assert_allclose(record.values["torque"][known], 1e3 * TORQUE[known], rtol=1e-4)
    assert "1 gaps" in " ".join(record.notes)
    assert [c.stop - c.start for c in record.segments("torque")] == [100, 240]
    # Twenty rows share each whole second.
    seconds = texts(np.floor(TIME + 1e-9), 0)
    record = read(
        tmp_path, rows(("Time [s]", "RPM", "TQ [kNm]"), seconds, texts(RPM), texts(TORQUE))
    )
    np.testing.assert_allclose(record.values["torque"], 1e3 * TORQUE, rtol=1e-4)
    empty = plain().replace(texts(TORQUE)[57], "", 1).replace(texts(TORQUE)[90], "-999.25", 1)
    assert np.isfinite(read(tmp_path, empty).values["torque"]).all()


def test_other_formats_hold_the_same(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = {"time_s": TIME, "rpm": RPM, "torque_kNm": TORQUE}
    parquet.write_table(pyarrow.table(columns), tmp_path / "record.parquet")
    check(read_record(tmp_path / "record.parquet"))
    stamped = pyarrow.table(
        {
            **columns,
            "time_s": pyarrow.array(
                (1.7e15 + 1e6 * TIME).astype("int64"), pyarrow.timestamp("us", "UTC")
            ),
        }
    )
    parquet.write_table(
        stamped.rename_columns(["stamp", "rpm", "torque_kNm"]), tmp_path / "t.parquet"
    )
    check(read_record(tmp_path / "t.parquet", ["time=stamp"]))
    for compress in (False, True):
        scipy.io.savemat(tmp_path / "record.mat", columns, do_compression=compress)
        check(read_record(tmp_path / "record.mat"))


def test_las_by_time(tmp_path):
    pytest.importorskip("lasio")
    body = "\n".join(f"{a:.2f} {b:.4f} {c:.4f}" for a, b, c in zip(TIME, RPM, TORQUE, strict=True))
    las = (
        "~VERSION INFORMATION\n VERS. 2.0 : CWLS\n WRAP. NO : one line a row\n~WELL\n"
        " STRT.s 0.0 :\n STOP.s 19.95 :\n STEP.s 0.05 :\n NULL. -999.25 :\n~CURVE\n"
        " TIME.s : time\n RPM .rpm : rotary speed\n STOR.kN.m : torque\n~A\n" + body + "\n"
    )
    check(read(tmp_path, las, ["torque=STOR [kN*m]"], "record.las"))
    check(read(tmp_path, las, name="record.las"))


@pytest.mark.parametrize(
    ("name", "quantity"),
    [
        ("Surface RPM", "rotary_speed"), ("TDRPM", "rotary_speed"), ("Bit RPM", "bit_speed"),
        ("DownholeRpm", "bit_speed"), ("RPM setpoint", None), ("Motor RPM", None),
        ("STOR", "torque"), ("TD_Torque", "torque"), ("Downhole Torque", "bit_torque"),
        ("Torque limit", None), ("WOB", "weight_on_bit"), ("Weight on Bit", "weight_on_bit"),
        ("Hook Load", "hook_load"), ("HKLD", "hook_load"), ("Block Position", "block_position"),
        ("ROP", "rate_of_penetration"), ("Bit Depth", "depth"), ("Zeit", "time"), ("SPP", None),
    ],
)  # fmt: skip
def test_names_say_what_they_are_of(name, quantity):
    assert quantity_of(name) == quantity


def bad_files():
    """Texts that are damaged, each in its way, and a word of the answer."""
    lines = plain().splitlines()
    head, body = lines[0], lines[1:]

    def at(row, new):
        return "\n".join([head, *body[:row], new, *body[row + 1 :]])

    yield "empty", "", "header"
    yield "header alone", head, "header"
    yield "no numbers", "a,b,c\nd,e,f\ng,h,i\n", "rows"
    yield "one column", "\n".join(texts(TIME)), "columns"
    for row, cut in itertools.product((0, 57, COUNT - 1), (1, 2)):
        yield "short row", at(row, ",".join(body[row].split(",")[:cut])), "cells"
        yield "long row", at(row, body[row] + ",7" * cut), "cells"
    for row, odd in itertools.product(
        (0, 133, COUNT - 1), ("x", "1.2.3", "12e", "0x1F", "1_0", "inf", "١", "#REF!", "??")
    ):
        yield "odd torque", at(row, f"{TIME[row]:.2f},{RPM[row]:.3f},{odd}"), "Torque"
        yield "odd time", at(row, f"{odd},{RPM[row]:.3f},8"), "Time"
    for huge in ("1e9", "-1e12", "9" * 30):
        yield "huge rpm", at(50, f"2.5,{huge},8"), "RPM"
        yield "huge time", at(50, f"{huge},120,8"), "step"
    yield "header again", "\n".join([*lines[:100], head, *lines[100:]]), "header again"
    yield "few rows", "\n".join(lines[:30]), "at least"
    yield (
        "same times",
        rows(("Time [s]", "RPM", "TQ [kNm]"), ["1"] * COUNT, texts(RPM), texts(TORQUE)),
        "times",
    )
    yield (
        "no torque",
        rows(("Time [s]", "RPM", "SPP [bar]"), texts(TIME, 2), texts(RPM), texts(TORQUE)),
        "torque",
    )
    yield (
        "no speed",
        rows(("Time [s]", "SPP", "TQ [kNm]"), texts(TIME, 2), texts(RPM), texts(TORQUE)),
        "rotary_speed",
    )
    yield (
        "no time",
        rows(("A", "RPM", "TQ [kNm]"), texts(TIME, 2), texts(RPM), texts(TORQUE)),
        "time",
    )
    yield (
        "two torques",
        rows(
            ("Time [s]", "RPM", "TQ1 [kNm]", "Torque [kNm]", "Trq [kNm]"),
            texts(TIME, 2),
            texts(RPM),
            texts(TORQUE),
            texts(TORQUE),
            texts(TORQUE),
        ),
        "one column",
    )
    yield (
        "two times",
        rows(
            ("Time [s]", "Elapsed [s]", "RPM", "TQ [kNm]"),
            texts(TIME),
            texts(TIME),
            texts(RPM),
            texts(TORQUE),
        ),
        "one column",
    )
    yield "one name twice", plain(("Time [s]", "TQ [kNm]", "TQ [kNm]")), "once"
    yield "no unit", plain(("Time [s]", "RPM", "Torque")), "--column"
    yield "not a torque's unit", plain(("Time [s]", "RPM", "Torque [bar]")), "torque"
    yield "two readings", plain(("Time [s]", "RPM [Hz]", "Torque [kNm]")), "rotary speed"
    yield "no header", "\n".join(body), "named"
    yield "minutes apart", plain(("Time", "RPM", "TQ [kNm]")).replace(".", ""), "unit of Time"
    yield (
        "mixed signs",
        plain().replace(",", ";").replace(".", ",").replace("kN,m", "kNm").replace("8,", "8.", 9),
        "decimal comma",
    )
    yield (
        "all empty",
        rows(("Time [s]", "RPM", "TQ [kNm]"), texts(TIME, 2), texts(RPM), [""] * COUNT),
        "no numbers",
    )
    yield "open quote", at(9, '"2.5,120,8'), ""
    yield "zero bytes", plain().replace("8.", "\0."), "text"
    for odd in ("2026-13-01T00:00:00", "yesterday", "25:61:00", "2026-03-01"):
        cells = stamps()
        cells[77] = odd
        yield (
            "odd stamp",
            rows(("Time", "RPM", "TQ [kNm]"), cells, texts(RPM), texts(TORQUE)),
            "Time",
        )
    cells = stamps()
    cells[200] = cells[200][:-6]
    yield "zone lost", rows(("Time", "RPM", "TQ [kNm]"), cells, texts(RPM), texts(TORQUE)), "zone"
    clocks = [f"12:00:{t:06.3f}" for t in TIME]
    clocks[3] = "12:77:00"
    yield "odd clock", rows(("Time", "RPM", "TQ [kNm]"), clocks, texts(RPM), texts(TORQUE)), "Time"
    epoch = rows(("Time", "RPM", "TQ [kNm]"), texts(1.7e9 + TIME, 2), texts(RPM), texts(TORQUE))
    yield "epoch of unknown unit", epoch, "1970"


DAMAGED = list(bad_files())


def answer(path):
    try:
        read_record(path)
    except InputError as error:
        return str(error)
    return "\n was read \n"


def test_a_hundred_damaged_files_are_answered_in_one_line_each(tmp_path):
    binary = io.BytesIO()
    scipy.io.savemat(binary, {"time_s": TIME, "rpm": RPM, "torque_kNm": TORQUE})
    sound = binary.getvalue()
    files = [("record.csv", name, text.encode(), word) for name, text, word in DAMAGED]
    for place in range(0, len(sound), len(sound) // 30):
        files.append(("record.mat", "cut", sound[:place], ""))
    assert len(files) >= 100
    for ending in ("parquet", "las", "xlsx", "doc"):
        files.append((f"record.{ending}", "of another kind", b"\x00PAR1\xff" * 40, ""))
    for file, name, content, word in files:
        (tmp_path / file).write_bytes(content)
        said = answer(tmp_path / file)
        assert "\n" not in said, (name, content[:60], content[-60:])
        assert word in said, (name, said)
        assert len(said) < 700, name


def test_what_the_user_says_is_checked(tmp_path):
    for told, word in (
        (["torque"], "QUANTITY=COLUMN"), (["power=TQ"], "QUANTITY=COLUMN"),
        (["torque=TQ9 [kNm]"], "Torque"), (["torque=Torque [rpm]"], "torque"),
        (["torque=RPM [kNm]", "torque=RPM [kNm]"], "only one"),
        (["time=RPM [kg]", "torque=Torque [kNm]", "rotary_speed=Torque [rpm]"], "RPM"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=word) as caught:
            read(tmp_path, plain(("Time [s]", "RPM", "Torque")), told)
        assert "\n" not in str(caught.value)
    for path in (tmp_path, tmp_path / "no.csv", "\0.csv", "/dev/zero"):
        with pytest.raises(InputError, match="record"):
            read_record(path)
