"""
Add my own friction law
=======================

Field data often show that the torque on the bit falls as it turns faster. What does that do
to the stability of point D, and can torque feedback make up for it?
"""

from dataclasses import replace

import casadi as ca

from drillctrl import OperatingPoint, analyze, design, dimensionless_plant

# The plant is a set of CasADi expressions: take the bit's speed and add a torque that falls
# from DROP at standstill towards zero within a few units of speed (Stribeck's law). What it
# is in steady drilling is balanced by the string, so only the difference acts.
DROP, DECAY = 40.0, 1.5
base = dimensionless_plant()
omega0 = base.parameters[base.parameter_names.index("omega0")]
bit_speed = omega0 + base.state[base.state_names.index("dtheta")]
extra = DROP * (ca.exp(-bit_speed / DECAY) - ca.exp(-omega0 / DECAY))
weakening = replace(base, rhs=ca.vertcat(base.rhs[:-1], base.rhs[-1] - extra))

# Everything else follows: linearisation, roots, gains within bounds.
point = OperatingPoint(omega0=5.1, delta0=1.75, psi=14)
print(f"paper's friction:   α = {analyze(point).spectral_abscissa:+.4f}")
print(f"weakening friction: α = {analyze(point, plant=weakening).spectral_abscissa:+.4f}")
result = design(point, "pd", plant=weakening)
print(f"with {result!r}")
