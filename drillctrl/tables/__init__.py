"""Gain tables: designs over a grid of operating points, checked in between, and exported."""
