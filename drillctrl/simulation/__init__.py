"""Event-driven simulation of the nonlinear plant, and of the linear one."""
