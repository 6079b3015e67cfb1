"""A part of a plant with named parameters: bit–rock law, string, drive, sensor."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Self

from drillctrl.base.errors import InputError, checked_number


class Part:
    """Named numbers that travel with a part, may be charted over, and never change.

    Two parts are equal if they are of one form and have the same values. Parts of one form
    share what is derived and compiled for them; values are arguments of that.

    Attributes
    ----------
    parameters : mapping
        Name → value unless given; of the class.
    quantities : mapping
        Name → quantity as in `quantities`, for parameters that are no plain numbers.
    values : mapping
        Name → value of this one.

    Parameters
    ----------
    **values : float
        Parameters that are not as in ``parameters``.

    Raises
    ------
    InputError
        If there is no such parameter, or a value is not finite.
    """

    parameters: ClassVar[Mapping[str, float]] = {}
    quantities: ClassVar[Mapping[str, str]] = {}
    values: Mapping[str, float]

    def __init__(self, **values: float) -> None:
        for name in values:
            if name not in self.parameters:
                known = ", ".join(self.parameters) or "none: it has no parameters"
                raise InputError(f"parameter of {type(self).__name__}", name, f"one of {known}")
        merged = {**self.parameters, **values}
        object.__setattr__(
            self,
            "values",
            MappingProxyType({name: checked_number(name, v) for name, v in merged.items()}),
        )

    def with_values(self, **changes: float) -> Self:
        """Return the same part with other values of some parameters."""
        changed = copy.copy(self)
        Part.__init__(changed, **{**self.values, **changes})
        return changed

    @property
    def form(self) -> Any:
        """What the part is apart from its values; a part with settings of its own adds them."""
        return type(self)

    @property
    def text(self) -> str:
        """What the part is and its values, in words that do not change from run to run."""
        inside = [f"{name}={value!r}" for name, value in self.values.items()]
        inside += [
            f"{name}={_setting_text(value)}" for name, value in sorted(self.settings.items())
        ]
        kind = type(self)
        return f"{kind.__module__}.{kind.__qualname__}({', '.join(inside)})"

    @property
    def settings(self) -> dict[str, Any]:
        """What the part was made with beside its parameters."""
        own = self.__dict__.items()
        hidden = ("values", "parameters", "quantities")
        return {n: v for n, v in own if n not in hidden and not n.startswith("_")}

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{type(self).__name__} is frozen; use with_values")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Part):
            return NotImplemented
        return self.form == other.form and dict(self.values) == dict(other.values)

    def __hash__(self) -> int:
        return hash((self.form, tuple(sorted(self.values.items()))))

    def __reduce__(self) -> tuple[Any, ...]:
        state = {name: value for name, value in self.__dict__.items() if name != "values"}
        return _rebuilt, (type(self), state, dict(self.values))

    def __repr__(self) -> str:
        inside = ", ".join(f"{name}={value:g}" for name, value in self.values.items())
        return f"{type(self).__name__}({inside})"


def _setting_text(value: Any) -> str:
    # A function shows where it is kept in memory, which is never the same.
    if callable(value) and hasattr(value, "__qualname__"):
        return f"{value.__module__}.{value.__qualname__}"
    return repr(value)


def _rebuilt(kind: type[Part], state: dict[str, Any], values: dict[str, float]) -> Part:
    part = object.__new__(kind)
    part.__dict__.update(state)
    part.__dict__["values"] = MappingProxyType(values)
    return part
