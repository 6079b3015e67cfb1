"""Campaigns: the nonlinear motion after disturbances of many sizes, over many operating points."""
