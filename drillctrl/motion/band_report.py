"""What is told of the bit's response over a band of frequencies."""

from __future__ import annotations

from typing import Any

from drillctrl.base.text import finite_or_none
from drillctrl.motion.band import BitBand
from drillctrl.motion.units import told_units, units_of
from drillctrl.motion.words import theory_lines
from drillctrl.spectrum.roots import spectral_abscissa


def band_fields(found: BitBand) -> dict[str, Any]:
    """Return the JSON fields of a band; in SI where there is a rig."""
    units = units_of(found.case)
    model = found.rational()
    growth = spectral_abscissa(found.system())
    return {
        "samples": [
            {
                "frequency": each.frequency / units.time,
                "amplitude": each.amplitude,
                "response_re": finite_or_none(each.value.real * units.response),
                "response_im": finite_or_none(each.value.imag * units.response),
                "response_error": finite_or_none(each.error * units.response),
            }
            for each in found.responses
        ],
        "model": {
            "constant": model.constant * units.response,
            "poles": [[p.real / units.time, p.imag / units.time] for p in model.poles.tolist()],
            "residues": [
                [r.real * units.response / units.time, r.imag * units.response / units.time]
                for r in model.residues.tolist()
            ],
            "error": model.error * units.response,
        },
        "growth_rate": growth / units.time,
        "growing_roots": found.count_growing(),
    }


def band_summary(found: BitBand) -> str:
    """Return what is told of a band on a terminal; of a rig the answer first."""
    units, model = told_units(found.case), found.rational()
    rig = bool(units.rate_name)
    amplitude = sum(each.amplitude for each in found.responses) / len(found.responses)
    unit = f", {units.response_name}" if rig else ""
    lines = [
        f"H over frequency at a swing of {amplitude:.3g}{unit}",
        f"{'Hz' if rig else 'ω':>9} {'Re H':>9} {'Im H':>9} {'±':>7}",
    ]
    for each in found.responses:
        place = each.frequency / units.turn
        value, error = each.value * units.response, each.error * units.response
        lines.append(f"{place:9.4g} {value.real:9.4g} {value.imag:9.4g} {error:7.2g}")
    growth = spectral_abscissa(found.system()) / units.time
    counted = found.count_growing()
    told = (
        "cannot be told from the band" if counted is None else f"{counted}, counted with H itself"
    )
    lines += [
        f"Rational model: {model.poles.size} poles, within {model.error * units.response:.2g}.",
        f"Torsional loop with it: growth rate {growth:.4g}{' 1/s' if rig else ''}; growing "
        f"roots: {told}.",
    ]
    if not rig:
        return "\n".join(lines)
    ends = [found.responses[k].frequency / units.turn for k in (0, -1)]
    does = "decay, the slowest" if growth < 0.0 else "GROW, the fastest"
    return "\n".join(
        [
            f"Swings of ±{100.0 * amplitude:.3g} % of the bit's speed {does} by "
            f"{abs(growth):.3g} 1/s.",
            f"Damping that the bit adds, {ends[0]:.3g} to {ends[1]:.3g} Hz",
            f"{'Hz':>9} {units.response_name:>14} {'±':>7}",
            *(
                f"{each.frequency / units.turn:9.4g} {each.value.real * units.response:14.4g} "
                f"{each.error * units.response:7.2g}"
                for each in found.responses
            ),
            *theory_lines(lines),
        ]
    )
