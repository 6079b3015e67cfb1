"""The compiled integrator. Not imported from here: see `drillctrl.simulation.compile`."""
