"""The drilling rig: its parameters, points, physics and feedback structures."""
