"""A table as a controller in C99: one header, one source, no allocation, no library."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from drillctrl.errors import InputError, checked_integer, checked_number
from drillctrl.files import write_text
from drillctrl.spectrum.characteristic import FloatArray
from drillctrl.tables.document import SIGN, rig_gain_units, to_document
from drillctrl.tables.interpolation import UNSAFE
from drillctrl.tables.table import GainTable

REALS = ("double", "float")


def export_c(
    table: GainTable,
    folder: str | Path,
    name: str = "gain_table",
    *,
    period: float,
    limit: float,
    real: str = "double",
    ramp: int = 0,
) -> tuple[Path, Path]:
    """Write ``NAME.h`` and ``NAME.c``: lookup, delay line, saturation, soft switch-on.

    The controller is sampled. Outputs are perturbations from steady drilling, in the units of
    the table: dimensionless with u in units of Kt, or, over a grid in rig units, rad, rad/s, s
    and N·m. The delayed outputs are those of the instant τ0 ago, linear between samples. The
    law has no integrator, so a saturated command winds nothing up. After switch-on the command
    is scaled from 0 to its full size over ``ramp`` samples.

    Parameters
    ----------
    table : GainTable
        Over dimensionless groups, or in rig units: then the lookup takes the grid's axes in SI.
    folder : str or Path
        Where the two files go; it must exist.
    name : str
        Prefix of files and functions, a C identifier.
    period : float
        Sampling period, dimensionless or s.
    limit : float
        Largest |u|, dimensionless or N·m.
    real : {"double", "float"}
        Type of the arithmetic.
    ramp : int
        Samples of the switch-on; 0 for none.

    Returns
    -------
    tuple of Path
        Header and source.

    Raises
    ------
    InputError
        If a value is out of range, the structure drives more than one input, or it has
        no gains in rig units over a grid in rig units.
    """
    step = checked_number("period", period, 0.0, 1e6, open_low=True)
    bound = checked_number("limit", limit, 0.0, 1e9, open_low=True)
    count = checked_integer("ramp", ramp, 0, 10**9)
    if real not in REALS:
        raise InputError("real", real, f"one of {', '.join(REALS)}")
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,30}", name):
        raise InputError("name", name, "a C identifier of at most 31 characters")
    if len(table.structure.inputs) != 1:
        raise InputError("structure", table.structure.name, "one with a single input")
    rig, factors = table.grid.rig, rig_gain_units(table)
    if rig is not None and factors is None:
        raise InputError("structure", table.structure.name, "torque fed back from θ and θ'")
    scale = np.array([factor for factor, _ in factors]) if factors else np.ones(1)
    longest = max(point.delay for point in table.grid.points)
    longest *= rig.time_scale if rig is not None else 1.0
    depth = int(longest / step) + 3
    if depth > 1_000_000:
        raise InputError("period", step, f"at least {longest / 1e6:g}, for a delay of {longest:g}")
    header = Path(folder) / f"{name}.h"
    source = Path(folder) / f"{name}.c"
    outputs = len(table.structure.outputs)
    words = {
        "name": name,
        "NAME": name.upper(),
        "real": real,
        "outputs": str(outputs),
        "depth": str(depth),
        "sign": SIGN.replace("theta''", "the torsional acceleration"),
        "names": ", ".join(table.structure.outputs),
        "units": "dimensionless" if rig is None else "rad, rad/s, s, N m",
        "axes": ", ".join(f"{axis.name} ({axis.unit})" for axis in table.grid.axes),
        "checksum": to_document(table).header["checksum"],
        "bounds": ", ".join(
            f"{n} {low:g}..{high:g}"
            for n, low, high in zip(
                table.structure.entry_names,
                table.structure.flat_lower,
                table.structure.flat_upper,
                strict=True,
            )
        ),
        "period": _number(step, real),
        "limit": _number(bound, real),
        "ramp": str(count),
        "suffix": "F" if real == "float" else "",
        "tables": _tables(table, scale, name, real),
    }
    text = {header: _HEADER, source: _SOURCE}
    for path, template in text.items():
        write_text(path, re.sub(r"@(\w+)@", lambda match: words[match[1]], template))
    return header, source


def _number(value: float, real: str) -> str:
    return f"{value:.17e}" if real == "double" else f"{value:.9e}F"


def _array(kind: str, name: str, values: list[str]) -> str:
    lines = [", ".join(values[i : i + 4]) for i in range(0, len(values), 4)]
    body = ",\n    ".join(lines)
    return f"static const {kind} {name}[{len(values)}] = {{\n    {body}\n}};\n"


def _tables(table: GainTable, scale: FloatArray, name: str, real: str) -> str:
    grid = table.grid
    kind = f"{name}_real"
    parts = [
        _array(kind, f"axis{i}", [_number(v, real) for v in axis.values])
        for i, axis in enumerate(grid.axes)
    ]
    entries = (table.entries * scale).ravel().tolist()
    parts.append(_array(kind, "node_gains", [_number(v, real) for v in entries]))
    own = table.entries_of(table.cells.gains) * scale
    listed = [row for row, mode in zip(own.tolist(), table.cells.mode.tolist(), strict=True)
              if mode == 1]  # fmt: skip
    index, modes = 0, []
    for mode in table.cells.mode.tolist():
        # Position of the constant gains plus 1, 0 for interpolation, -1 for not vouched for.
        index += mode == 1
        modes.append(str(index) if mode == 1 else "-1" if mode == UNSAFE else "0")
    flat = [_number(v, real) for row in listed for v in row] or [_number(0.0, real)]
    parts += [_array("int32_t", "cell_mode", modes), _array(kind, "cell_gains", flat)]
    return "\n".join(parts)


_HEADER = """\
/* Scheduled delayed output feedback, generated by drillctrl; do not edit.
 *
 * Law:        @sign@.
 * Outputs Y:  @names@, as perturbations from steady drilling
 * Units:      @units@
 * Lookup:     @axes@, clamped at the ends of the table
 * Bounds:     @bounds@ (dimensionless)
 * Table:      SHA-256 @checksum@
 *
 * No allocation, no recursion, no library beyond stdint.h. One state object a controller;
 * functions keep nothing elsewhere. */
#ifndef @NAME@_H
#define @NAME@_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef @real@ @name@_real;

#define @NAME@_OUTPUTS @outputs@
#define @NAME@_DEPTH @depth@
#define @NAME@_GAINS (2 * @NAME@_OUTPUTS)

typedef struct {
    @name@_real past[@NAME@_DEPTH][@NAME@_OUTPUTS]; /* ring of samples */
    int32_t newest;                                 /* where the newest stands */
    int32_t filled;                                 /* how many there are */
    int32_t active;                                 /* samples since switch-on; 0: off */
} @name@_state;

/* Forget all samples and switch off. */
void @name@_init(@name@_state *state);

/* Gains at coordinates, K1 then K2. Returns 1 where the table vouches for them, else 0:
 * outside the table, or in a cell where no stable gains were found. Coordinates that are no
 * numbers give the gains at the low ends, and 0. */
int32_t @name@_lookup(const @name@_real at[3], @name@_real gains[@NAME@_GAINS]);

/* One sample: store Y, and return u within the limit. While `on` is 0, u is 0 and samples are
 * stored all the same, so that the delayed outputs are there at switch-on. `delay` is tau0 in
 * the unit of the sampling period, and is held within the length of the ring; before the first
 * sample, outputs count as 0. */
@name@_real @name@_step(@name@_state *state, const @name@_real y[@NAME@_OUTPUTS],
                        const @name@_real at[3], @name@_real delay, int32_t on);

#ifdef __cplusplus
}
#endif

#endif
"""

_SOURCE = """\
/* Generated by drillctrl; do not edit. See the header. */
#include "@name@.h"

#define PERIOD @period@
#define LIMIT @limit@
#define RAMP @ramp@

@tables@
static int32_t find(const @name@_real *axis, int32_t count, @name@_real value,
                    @name@_real *share, int32_t *inside)
{
    int32_t low = 0;
    int32_t high = count - 1;
    @name@_real fraction;

    if (!((value >= axis[0]) && (value <= axis[high]))) {
        *inside = 0;
    }
    if (count == 1) {
        *share = 0.0@suffix@;
        return 0;
    }
    while ((high - low) > 1) {
        const int32_t middle = low + ((high - low) / 2);
        if (value >= axis[middle]) {
            low = middle;
        } else {
            high = middle;
        }
    }
    fraction = (value - axis[low]) / (axis[low + 1] - axis[low]);
    if (!(fraction > 0.0@suffix@)) {
        fraction = 0.0@suffix@;
    } else if (fraction > 1.0@suffix@) {
        fraction = 1.0@suffix@;
    } else {
        /* within the cell */
    }
    *share = fraction;
    return low;
}

void @name@_init(@name@_state *state)
{
    int32_t i;
    int32_t j;

    for (i = 0; i < @NAME@_DEPTH; i++) {
        for (j = 0; j < @NAME@_OUTPUTS; j++) {
            state->past[i][j] = 0.0@suffix@;
        }
    }
    state->newest = 0;
    state->filled = 0;
    state->active = 0;
}

int32_t @name@_lookup(const @name@_real at[3], @name@_real gains[@NAME@_GAINS])
{
    const int32_t n0 = (int32_t)(sizeof(axis0) / sizeof(axis0[0]));
    const int32_t n1 = (int32_t)(sizeof(axis1) / sizeof(axis1[0]));
    const int32_t n2 = (int32_t)(sizeof(axis2) / sizeof(axis2[0]));
    const int32_t c1 = (n1 > 1) ? (n1 - 1) : 1;
    const int32_t c2 = (n2 > 1) ? (n2 - 1) : 1;
    @name@_real share[3];
    int32_t inside = 1;
    int32_t mode;
    int32_t corner;
    int32_t k;
    const int32_t i0 = find(axis0, n0, at[0], &share[0], &inside);
    const int32_t i1 = find(axis1, n1, at[1], &share[1], &inside);
    const int32_t i2 = find(axis2, n2, at[2], &share[2], &inside);

    mode = cell_mode[(((i0 * c1) + i1) * c2) + i2];
    if (mode > 0) {
        for (k = 0; k < @NAME@_GAINS; k++) {
            gains[k] = cell_gains[((mode - 1) * @NAME@_GAINS) + k];
        }
    } else {
        for (k = 0; k < @NAME@_GAINS; k++) {
            gains[k] = 0.0@suffix@;
        }
        for (corner = 0; corner < 8; corner++) {
            const int32_t o0 = (corner / 4) % 2;
            const int32_t o1 = (corner / 2) % 2;
            const int32_t o2 = corner % 2;
            const @name@_real weight = ((o0 == 1) ? share[0] : (1.0@suffix@ - share[0]))
                                     * ((o1 == 1) ? share[1] : (1.0@suffix@ - share[1]))
                                     * ((o2 == 1) ? share[2] : (1.0@suffix@ - share[2]));
            if (weight > 0.0@suffix@) {
                const int32_t node = ((((i0 + o0) * n1) + (i1 + o1)) * n2) + (i2 + o2);
                for (k = 0; k < @NAME@_GAINS; k++) {
                    gains[k] += weight * node_gains[(node * @NAME@_GAINS) + k];
                }
            }
        }
    }
    return ((inside == 1) && (mode >= 0)) ? 1 : 0;
}

@name@_real @name@_step(@name@_state *state, const @name@_real y[@NAME@_OUTPUTS],
                        const @name@_real at[3], @name@_real delay, int32_t on)
{
    @name@_real gains[@NAME@_GAINS];
    @name@_real u = 0.0@suffix@;
    @name@_real back = delay / PERIOD;
    int32_t whole;
    int32_t k;

    state->newest = (state->newest + 1) % @NAME@_DEPTH;
    for (k = 0; k < @NAME@_OUTPUTS; k++) {
        state->past[state->newest][k] = y[k];
    }
    if (state->filled < @NAME@_DEPTH) {
        state->filled++;
    }
    if (on == 0) {
        state->active = 0;
        return 0.0@suffix@;
    }
    if (!(back > 0.0@suffix@)) {
        back = 0.0@suffix@;
    } else if (back > (@name@_real)(@NAME@_DEPTH - 2)) {
        back = (@name@_real)(@NAME@_DEPTH - 2);
    } else {
        /* within the ring */
    }
    whole = (int32_t)back;
    (void)@name@_lookup(at, gains);
    for (k = 0; k < @NAME@_OUTPUTS; k++) {
        const @name@_real part = back - (@name@_real)whole;
        const int32_t near = (state->newest - whole + @NAME@_DEPTH) % @NAME@_DEPTH;
        const int32_t far = (near - 1 + @NAME@_DEPTH) % @NAME@_DEPTH;
        /* Cleared entries stand for the time before the first sample. */
        const @name@_real then = ((1.0@suffix@ - part) * state->past[near][k])
                               + (part * state->past[far][k]);
        u += (gains[k] * y[k]) + (gains[@NAME@_OUTPUTS + k] * then);
    }
    if (RAMP > 0) {
        if (state->active < RAMP) {
            state->active++;
            u *= (@name@_real)state->active / (@name@_real)RAMP;
        }
    }
    /* Written so that a u that is no number becomes 0. */
    if (u > LIMIT) {
        u = LIMIT;
    } else if (u < -LIMIT) {
        u = -LIMIT;
    } else if (!(u == u)) {
        u = 0.0@suffix@;
    } else {
        /* within the limit */
    }
    return u;
}
"""
