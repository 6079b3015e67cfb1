"""Designs of feedback gains, what is said of them and what else would help."""
