"""Real drill strings: tallies of pipe, exact receptances, finite elements, modes and drives."""
