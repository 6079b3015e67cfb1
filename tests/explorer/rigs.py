"""Rig files that a window opens."""

LUMPED = """\
mass = "40 t"
inertia = "120 kg*m^2"
axial_stiffness = "700 kN/m"
torsional_stiffness = "938 N*m/rad"
axial_damping = "15.6 kN*s/m"
torsional_damping = "32.9 N*m*s/rad"
rock_strength = "60 MPa"
contact_strength = "60 MPa"
bit_radius = "108 mm"
wearflat_length = "1.2 mm"
cutter_inclination = 0.6
friction_coefficient = 0.6
bit_geometry = 1.0
submerged_weight = "330 kN"
"""
