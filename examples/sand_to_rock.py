"""
Which structure survives a sand-to-rock change?
===============================================

One set of gains has to do while the rock under the bit becomes twice as strong. Design for the
softer rock alone, design for the worst of both, and try the change on the nonlinear string.
"""

from drillctrl import (
    Change,
    Controller,
    OperatingPoint,
    Scenario,
    WorstCase,
    analyze,
    design,
    preset_structure,
    simulate,
)

# %%
# ψ is proportional to the rock's strength: from 10 to 20, with 15 in the middle. The linear loops
# alone are compared here.
sand, middle, rock = (OperatingPoint(omega0=10, delta0=2, psi=psi) for psi in (10.0, 15.0, 20.0))
both = WorstCase(psi=1 / 3)
for name in ("p", "case1", "case2"):
    for label, result in (
        ("for sand only", design(sand, name, trials=False)),
        ("for both", design(middle, name, objective=both, trials=False)),
    ):
        alphas = [
            analyze(point, name, result.K1, result.K2).spectral_abscissa for point in (sand, rock)
        ]
        print(f"{name:6} {label:14} α in sand {alphas[0]:+.3f}, in rock {alphas[1]:+.3f}")

# %%
# The change itself: ψ rises from 10 to 20 within 5 units of time while drilling goes on.
chosen = design(middle, "case1", objective=both)
controller = Controller(preset_structure("case1"), chosen.K1, chosen.K2)
scenario = Scenario(initial={"dtheta": 1.0}, changes=(Change(40.0, duration=5.0, psi=20.0),))
run = simulate(sand, controller, scenario=scenario, duration=120.0)
end = run.at([119.0, 120.0])
print(f"at the end x moves by {abs(end.x[1] - end.x[0]):.1e} in a unit of time: {run.status}")
figure = run.plot()
