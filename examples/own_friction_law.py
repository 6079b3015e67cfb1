"""
Add my own friction law
=======================

Field data often show that the torque on the bit falls as it turns faster. What does that do
to the stability of point D, and can torque feedback make up for it?
"""

import casadi as ca

from drillctrl import BitRock, Load, OperatingPoint, PaperLaw, analyze, as_case, design, paper_plant


# A law is a class: its parameters by name, and the load on the bit from what is cut, what is
# pressed, and how fast the bit moves (Stribeck's law here; `drillctrl.Stribeck` is another).
class VelocityWeakening(BitRock):
    """Wear torque that falls from ``drop`` at standstill towards nothing (Stribeck)."""

    parameters = {"drop": 40.0, "decay": 1.5}

    def load(self, c, contact, rates, q):
        weight, torque = PaperLaw().load(c, contact, rates, q)
        falling = q.drop * ca.exp(-ca.fabs(rates.rotary) / q.decay)
        return Load(weight, torque + falling * contact.pressed * contact.direction)


# Everything else follows: linearisation, roots, gains within bounds, charts, tables, runs.
point = OperatingPoint(omega0=5.1, delta0=1.75, psi=14)
weakening = as_case(point, paper_plant(bit=VelocityWeakening()))
print(f"paper's friction:   α = {analyze(point).spectral_abscissa:+.4f}")
print(f"weakening friction: α = {analyze(weakening).spectral_abscissa:+.4f}")
result = design(weakening, "pd")
print(f"with {result!r}")
