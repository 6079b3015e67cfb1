"""Write the recording that ships with drillctrl, its rig file and its truth.

``python -m tests.records.make_example`` from the root of the project; nothing of drillctrl is used.
"""

from pathlib import Path

import numpy as np

from tests.records.other_rig import OtherRig, recorded

RIG = OtherRig(length=2400.0, damping=0.18, static=4500.0, drop=3000.0, decay=5.0)
STIFFER, HEAVIER = 1.06, 0.97
SECONDS, RATE, LAG, SEED = 1200, 10.0, 0.05, 24
PLACE = Path(__file__).parents[2] / "drillctrl" / "records" / "example"


def recording(seconds=SECONDS):
    """Return time, rpm and N m as measured, the bit's true rpm, and weight on bit in kN."""
    count = int(seconds * RATE)
    time = np.arange(count) / RATE
    speed = np.interp(time, [0, 420, 425, 840, 845, 1200], [60, 60, 90, 90, 180, 180])
    weight = np.interp(
        time, [0, 240, 245, 620, 625, 840, 845, 1200], [80, 80, 95, 95, 80, 80, 40, 40]
    )
    t, top, torque, bit = recorded(
        RIG, speed, seconds, seed=SEED, rock=0.02, rate=RATE, lag=LAG, noise=(0.2, 60.0),
        steps=(0.1, 10.0), weight=weight / 80.0,
    )  # fmt: skip
    return t, top, torque, bit, weight


def main():
    """Write the three files."""
    t, top, torque, bit, weight = recording()
    shaken = weight + np.random.default_rng(1).normal(0.0, 1.0, weight.size)
    rows = "".join(
        f"{a:.1f},{b:.1f},{c / 1e3:.2f},{d:.0f},{e:.1f}\n"
        for a, b, c, d, e in zip(t, top, torque, shaken, bit, strict=True)
    )
    header = "Time [s],Surface RPM [rpm],Surface torque [kN.m],WOB [kN],Bit RPM [rpm]\n"
    (PLACE / "record.csv").write_text(header + rows, encoding="utf-8")
    head = (
        f"# The string is taken {STIFFER} times as stiff and {HEAVIER} times as heavy as it is.\n"
    )
    (PLACE / "rig.toml").write_text(head + RIG.toml(STIFFER, HEAVIER), encoding="utf-8")
    j, k = RIG.chain()
    n = RIG.elements
    modes = ", ".join(f"{value:.5f}" for value in RIG.modes(3))
    (PLACE / "truth.toml").write_text(
        "# What the recording was made with; SI units, frequencies in Hz.\n"
        f"stiffness = {1.0 / np.sum(1.0 / k[:n]):.2f}\n"
        f"inertia = {j[:n].sum() / 3.0 + j[n:].sum():.2f}\n"
        f"modes = [{modes}]\ndamping = {RIG.damping}\nkelvin_voigt = {RIG.retardation}\n"
        f"drive_inertia = {RIG.drive}\ndrive_gains = [{RIG.kp}, {RIG.ki}]\n"
        f"level = {RIG.static}\ndrop = {RIG.drop}\ndecay = {RIG.decay}\n"
        f"lag = {LAG}\nspeed_noise_rpm = 0.2\ntorque_noise = 60.0\n",
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
