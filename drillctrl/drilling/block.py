"""What is composed into a plant beside string and bit: drives, filters, late measurement."""

from __future__ import annotations

from typing import Any

from drillctrl.drilling.coefficients import Coefficients
from drillctrl.drilling.part import Part
from drillctrl.drilling.realisation import Realisation
from drillctrl.drilling.string import String


class Block(Part):
    """A part that changes the string, or the signals of its realisation, or both."""

    def mechanics(self, string: String, c: Coefficients, q: Any) -> String:
        """Return the string with what the block adds to it; by default nothing."""
        return string

    def signals(self, made: Realisation, c: Coefficients, q: Any) -> Realisation:
        """Return the first-order equations with what the block adds; by default nothing."""
        return made
