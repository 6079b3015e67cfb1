"""Delay systems and the feedback that closes a loop around them."""
