"""The motion that rigs drill with: the bit on its axial orbit, and the torsional loop about it."""
