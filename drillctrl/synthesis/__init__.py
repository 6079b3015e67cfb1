"""Bounded nonsmooth minimisation of the spectral abscissa over feedback gains."""
