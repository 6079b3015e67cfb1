"""Packages that only some users need."""

from __future__ import annotations

import importlib
from typing import Any

from drillctrl.base.errors import InputError


def required(module: str, extra: str) -> Any:
    """Return a module of a package that an extra installs.

    Parameters
    ----------
    module : str
        Its dotted name.
    extra : str
        Of drillctrl.

    Raises
    ------
    InputError
        If it is not installed; the message says how it would be.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        if error.name != package:
            raise
        wanted = f"installed: pip install 'drillctrl[{extra}]'"
        raise InputError(package, "missing", wanted) from None
