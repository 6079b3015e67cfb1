"""Feedback structures side by side on one set of measures."""
