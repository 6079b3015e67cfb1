"""Stability charts and volumes from explicit boundaries."""
