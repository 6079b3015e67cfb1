"""Strings fitted to recordings by travelling waves, against what these were made with.

Twenty-four rigs at random, each with a rig file that is off by up to 12 %: noise, rounding, lags,
gaps, stiff and soft drives, and a law of the bit of another form than the fit's. Run as
``python -m benchmarks.records [FIRST] [LAST] [SEED]``; a rig takes about ten seconds.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from drillctrl import check_rig, load_rig, read_record, study_record
from tests.records.other_rig import write_csv
from tests.records.wave_rig import RPM, WaveRig, wave_recorded

LENGTHS = (1200, 1700, 2400, 3200, 1300, 4200, 2000, 2800, 1250, 3600, 1500, 5000, 1200, 2200,
           3000, 1800)  # fmt: skip
PIPES = ((0.127, 0.1086), (0.1397, 0.1214), (0.1143, 0.0972))


def cases(count=24, seed=5):
    """Return rigs, how they are recorded, and by what their files are off."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(count):
        rig = WaveRig(
            length=float(LENGTHS[k % 16]), pipe=PIPES[k % 3],
            collars=(float(rng.uniform(80, 250)), 0.1715, 0.0714), bit=float(rng.uniform(3, 15)),
            damping=float(rng.uniform(0.06, 0.35)), drive=float(rng.uniform(1500, 3500)),
            soft=(0.0, 0.0, 3.0, 0.0)[k % 4], level=float(rng.uniform(2500, 5000)),
            drop=float(rng.uniform(2000, 4000)), decay=float(rng.uniform(4, 8)),
        )  # fmt: skip
        options = {"speed": float(rng.uniform(50, 100)), "seed": k,
                   "lag": float(rng.choice([0.01, 0.05, 0.1])), "gaps": (0, 2)[k % 2]}  # fmt: skip
        found.append((rig, options, (float(rng.uniform(0.88, 1.12)), rng.uniform(0.92, 1.08))))
    return found


def in_band(bit, time, study):
    """Return the rms of carried less true speed of the bit in the band, over that of the speed."""
    own = study.bit
    whole = np.interp(np.arange(own.speed.size), np.round(time * 20.0), bit)
    part = np.fft.rfft(whole)
    edge = np.clip((own.band - np.fft.rfftfreq(whole.size, 0.05)) / (0.2 * own.band), 0.0, 1.0)
    slow = np.fft.irfft(part * (0.5 - 0.5 * np.cos(np.pi * edge)), whole.size)
    known = np.isfinite(own.speed)
    off = own.speed[known] / RPM - slow[known]
    return float(np.sqrt(np.mean(off**2) / np.mean(slow[known] ** 2)))


def main() -> None:
    """Run them."""
    given = [int(word) for word in sys.argv[1:]]
    first, last, seed = (*given, *(0, 24, 5)[len(given) :])
    within: list[bool] = []
    print("  length speed   index found/true  speed rms   off, % [interval holds it]")
    for rig, options, off in cases(24, seed)[first:last]:
        with tempfile.TemporaryDirectory() as folder:
            time, top, torque, bit = wave_recorded(rig, **options)
            write_csv(Path(folder) / "r.csv", time, top, torque)
            for name, about in (("rig", (*off, 0.15)), ("true", (1.0, 1.0, rig.damping))):
                (Path(folder) / f"{name}.toml").write_text(rig.toml(*about))
            study = study_record(
                read_record(Path(folder) / "r.csv"), load_rig(Path(folder) / "rig.toml")
            )
            modes = check_rig(load_rig(Path(folder) / "true.toml")).torsional[:2]
        windows = [bit[k : k + 400] for k in range(0, bit.size - 400, 200)]
        index = np.median([np.ptp(w) / (2.0 * w.mean()) for w in windows])
        told = f"{rig.length:6.0f} m {options['speed']:4.0f} rpm {study.swing:8.2f}/{index:.2f}"
        told += f"{100.0 * in_band(bit, time, study):12.1f} % "
        fit = study.fit
        if fit is None or not fit.identifiable:
            print(told, "no string")
            continue
        for name, factor, truth in (
            ("stiffness", fit.factors[0], 1.0 / off[0]),
            ("inertia", fit.factors[1], 1.0 / off[1]),
            ("damping", fit.damping.value, rig.damping),
        ):
            estimate = getattr(fit, name)
            low, high = (factor * end / estimate.value for end in (estimate.low, estimate.high))
            told += f" {name} {100.0 * (factor / truth - 1.0):+.1f} [{low <= truth <= high}]"
        within.append(abs(fit.damping.value / rig.damping - 1.0) < 0.25)
        for mode, true in zip(study.modes, modes, strict=False):
            told += f" {100.0 * (mode.frequency / true.frequency - 1.0):+.1f} Hz"
        print(told, flush=True)
    print(f"damping within 25 % in {sum(within)} of {len(within)}")


if __name__ == "__main__":
    main()
