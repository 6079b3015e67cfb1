"""
A table for the drive's PLC
===========================

A drive cannot solve eigenvalue problems: it looks gains up. Design them over the speeds and
rates at which the rig drills, check between the nodes, and write files for the controller.
"""

import tempfile
from pathlib import Path

from drillctrl import dimensionless_grid, linear_axis, load_table, save_table, table

# %%
# Best gains at each node jump where one optimum takes over from another; giving up a little of
# the decay rate makes them vary smoothly. Only those that may be used are tried on the nonlinear
# motion.
grid = dimensionless_grid(linear_axis("omega0", 8, 20, 4), linear_axis("delta0", 1, 7, 4), 14.0)
best = table(grid, "case1", trials=False)
smooth = table(grid, "case1", give_up=0.15)
for label, gains in (("best", best), ("smooth", smooth)):
    print(f"{label}: largest jump {100 * gains.jump[0]:.0f} % of a gain's range")

# %%
# Between the nodes gains are interpolated, and the table says where it vouches for that.
K1, K2 = smooth.gains_at(11.3, 3.1, 14.0)
print(f"at (11.3, 3.1): K1 = {K1[0, 0, 0]:.4f}, K2 = {K2[0, 0, 0]:.4f}")
print(f"vouched for: {bool(smooth.stable_at(11.3, 3.1, 14.0)[0])}")

# %%
# What is written can be read back to the last bit.
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "gains.csv"
    save_table(smooth, path)
    print(f"same after reading: {bool((load_table(path).gains == smooth.gains).all())}")
figure = smooth.plot()
