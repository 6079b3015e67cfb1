"""
My bit sticks at 120 rpm: what can torque feedback do?
======================================================

A usual operating point of the rig of Table 1, 120 rpm and 20 m/h, lies left of the stability
boundary. What moves there, and what would help?
"""

from drillctrl import (
    Controller,
    Exact,
    OperatingPoint,
    RigPoint,
    analyze,
    design,
    preset_structure,
    simulate,
    table1,
)

# %%
# The linear answer first: unstable, and the best gains of the richest structure hardly help.
# The unstable mode is axial, cut after cut regenerating itself, and torque barely reaches it.
rig = table1()
usual = RigPoint(rig, rotary_speed=120 * 3.14159265 / 30, penetration_rate=20 / 3600)
point = usual.operating_point()
print(f"ω0 = {point.omega0:.3f}, δ0 = {point.delta0:.4f}")
print(f"without control: α = {analyze(usual).spectral_abscissa:+.4f}")
best = design(usual, "case2", objective=Exact(), trials=False)
print(f"best case2:      α = {best.spectral_abscissa:+.4f}")

# %%
# What an unstable linear model does in the end is up to the nonlinear one: here the bit stands
# still axially for a part of the time, and its speed hardly changes. Nothing sticks in torsion.
run = simulate(point, duration=300.0, initial={"dx": 0.01})
summary = run.summary
rpm = 30 / 3.14159265 / rig.time_scale
print(f"axially held {100 * summary.axial_stick_fraction:.0f} % of the time")
print(f"bit speed {summary.bit_speed_min * rpm:.0f} to {summary.bit_speed_max * rpm:.0f} rpm")
print(f"torsional stick {100 * summary.stick_fraction:.0f} % of the time")

# %%
# Torsional stick-slip is what torque feedback is for. At ω0 = 10 and a deep cut the open loop
# sticks; gains designed there bring it to rest when they are switched on.
deep = OperatingPoint(omega0=10, delta0=2.5, psi=14)
gains = design(deep, "case1")
controller = Controller(preset_structure("case1"), gains.K1, gains.K2, activation=150.0)
run = simulate(deep, controller, duration=300.0, initial={"dx": 1, "dtheta": 1})
last = [event.time for event in run.events if event.name == "stick"][-1]
print(f"last stick at t = {last:.1f}, settled: {run.summary.settled}")
figure = run.plot()
