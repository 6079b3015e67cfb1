"""
My bit sticks at 80 rpm
=======================

At 80 rpm and 30 m/h the rig of Table 1 drills quietly or sticks, as it happens to be kicked. Smooth
drilling is unstable there whatever torque does. Which gains help the motion that is drilled with?
"""

import math

import matplotlib.pyplot as plt
import numpy as np

from drillctrl import Drilling, RigPoint, as_case, design, simulate, table1

# %%
# Without control the motion depends on how it starts: a swing of 0.2 to 1 and more, where 1 means
# that the bit stands still at times.
where = RigPoint(table1(), 80 * math.pi / 30, 30 / 3600)
point = as_case(where).point
kick = {"dx": 0.5 * point.penetration_rate, "dtheta": 0.5 * point.omega0}


def swing(run):
    """Return (max − min)/(2 mean) of the bit's speed in the last quarter."""
    times = np.linspace(0.75 * run.times[-1], run.times[-1], 20_001)
    speed = point.omega0 + run.at(times, ("dtheta",)).dtheta
    return np.ptp(speed) / (2.0 * speed.mean())


free = simulate(where, duration=300.0, initial=kick, rtol=1e-7)
print(f"without control, after a kick forward: swing {swing(free):.2f}")

# %%
# Gains for that motion: the bit's torque is measured while its speed swings, gains are found that
# make such swings decay, and runs from several starts, with the drive's limit, choose how much of
# the bounds to use. (Swings up to 0.1 alone are measured here, to be quick.)
limit = 0.94e3 / table1().torsional_stiffness
found = design(where, "case1", objective=Drilling(kick=0.1), surroundings={"limit": limit})
print(found.reason)
print("K1 =", found.K1.ravel(), "K2 =", found.K2.ravel())
for trial in found.trials:
    mine, without = trial.controlled, trial.uncontrolled
    text = f"{trial.start.name:>13}: {mine.outcome}, swing {mine.swing:.2f}"
    print(f"{text}; without {without.outcome}")

# %%
# The verdict says when to switch on: once the bit sticks and slips, these gains within the limit
# need not get it out. Switched on in a quiet moment they keep it quiet, whatever kicks it.
run = simulate(where, found.controller(limit=limit), duration=300.0, initial=kick, rtol=1e-7)
print(f"with control, after the same kick: swing {swing(run):.2f}")
times = np.linspace(0.0, 300.0, 8001)
rpm = 30 / math.pi / table1().time_scale
figure, ax = plt.subplots(figsize=(6.4, 3.4), layout="constrained")
for each, label in ((free, "without control"), (run, "with control")):
    speed = point.omega0 + each.at(times, ("dtheta",)).dtheta
    ax.plot(times * table1().time_scale, speed * rpm, linewidth=0.8, label=label)
ax.set_xlabel("time, s")
ax.set_ylabel("bit speed, rpm")
figure.legend(loc="outside upper center", ncols=2)
