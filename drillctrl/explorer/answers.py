"""One question of the page, as JSON in and out; what a worker process does."""

from __future__ import annotations

import json
import math
import traceback
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.explorer.describe import describe, strings
from drillctrl.explorer.runs import gains, motion, vibrations
from drillctrl.explorer.state import read_asked
from drillctrl.explorer.views import Tell, nyquist, reflection, roots, stability

_OF_A_POINT: dict[str, Callable[..., dict[str, Any]]] = {
    "roots": roots,
    "nyquist": nyquist,
    "reflection": reflection,
    "motion": motion,
    "simulate": lambda asked, options, tell: motion(asked, {**options, "patient": True}, tell),
    "chart": stability,
    "map": vibrations,
    "gains": gains,
}
_OF_FIELDS: dict[str, Callable[..., dict[str, Any]]] = {"describe": describe, "strings": strings}
# Digits that are sent of what is drawn; the results themselves keep theirs.
_DIGITS = 7


def answer(question: str, tell: Tell) -> str:
    """Return one JSON object: ``result``, or ``error`` with a message for people.

    Parameters
    ----------
    question : str
        JSON: ``view``, ``state`` and ``options``.
    tell : callable
        Hears how far the work is.
    """
    try:
        asked = json.loads(question, parse_constant=_refused)
        view, state, options = (asked.get(name) for name in ("view", "state", "options"))
        if not isinstance(state, Mapping) or not isinstance(options, Mapping):
            raise InputError("state, options", "something else", "objects")
        view = view if isinstance(view, str) else ""
        if view in _OF_FIELDS:
            result = _OF_FIELDS[view](state, options, tell)
        elif view in _OF_A_POINT:
            result = _OF_A_POINT[view](read_asked(state), options, tell)
        else:
            raise InputError("view", view[:40], "one that the page has")
        return json.dumps({"result": plain(result)}, allow_nan=False, ensure_ascii=False)
    except InputError as error:
        return json.dumps({"error": str(error), "about": error.parameter})
    except Exception as error:
        # Ours, or input that nobody thought of: where it stands goes to the terminal.
        traceback.print_exc()
        return json.dumps({"error": f"{type(error).__name__}: this could not be computed"})


def _refused(word: str) -> float:
    raise InputError("number", word, "finite")


def plain(value: Any) -> Any:
    """Return JSON types: lists for arrays, in as many digits as are drawn; None for no number."""
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f":
            with np.errstate(all="ignore"):
                return _rounded(value)
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _rounded(values: Any) -> Any:
    flat = [
        float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None
        for value in values.ravel().tolist()
    ]
    if values.ndim == 1:
        return flat
    width = values.shape[1]
    return [flat[k : k + width] for k in range(0, len(flat), width)]
