"""
What do two more gains buy?
===========================

Which gains hold a rig steady at point C of the paper, with feedback of the bit's rotation alone
and with its speed as well?
"""

from drillctrl import OperatingPoint, design

point = OperatingPoint(omega0=10.0, delta0=1.75, psi=14.0)
for name in ("case1", "case2"):
    result = design(point, name)
    print(result.summary(), end="\n\n")

figure = result.plot().get_figure()
