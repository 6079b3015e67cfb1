"""Drilling: rig, operating point, string, bit and rock, composed into a plant."""
