"""Characteristic roots of delay systems: three routes that check one another."""
