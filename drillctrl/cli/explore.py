"""`drillctrl explore`: a page in the browser of this machine to look at a rig through."""

from __future__ import annotations

import contextlib
import math
import os
import sys
import webbrowser
from pathlib import Path
from typing import Any

import click

from drillctrl.base.errors import checked_integer
from drillctrl.base.extras import required
from drillctrl.cli.point import point_options, read_point
from drillctrl.cli.verb import Verb

# Of a point without a rig; blades and the wear flat stay the usual ones.
_GROUPS = ("omega0", "delta0", "psi", "eta", "xi", "kappa")


@click.command(name="explore", cls=Verb)
@point_options
@click.option("--port", type=int, default=0, help="Of the page; without it one that is free.")
@click.option("--no-browser", is_flag=True, help="Print the address alone.")
def explore_command(port: int, no_browser: bool, **point: Any) -> None:
    """Open a page in the browser: move the point and the gains, and see what becomes of it.

    Its address is the first line printed. The page is for this machine alone and asks nothing
    of any other. Ctrl-C ends it.

    \b
    Examples:
      drillctrl explore
      drillctrl explore --rig table1 --speed "120 rpm" --rop "20 m/h"
    """
    checked_integer("port", port, 0, 65535)
    where = read_point(point)
    required("tornado", "explore")
    import asyncio

    from drillctrl.explorer.server import bound, serve

    initial = _state(where, point)
    listening = bound(port)

    def announce(address: str) -> None:
        click.echo(address)
        sys.stdout.flush()
        if not no_browser and _has_screen():
            # A browser that cannot be started is no reason to end: the address was printed.
            with contextlib.suppress(OSError, webbrowser.Error):
                webbrowser.open(address)

    with listening:
        asyncio.run(serve(listening, initial, announce))


def _has_screen() -> bool:
    """Whether a window can be opened; a browser in the terminal would take its place."""
    named = ("DISPLAY", "WAYLAND_DISPLAY")
    return not sys.platform.startswith("linux") or any(os.environ.get(name) for name in named)


def _state(where: Any, point: dict[str, Any]) -> dict[str, Any]:
    """Return the state that a window begins with."""
    from drillctrl.base.language import SI
    from drillctrl.drilling.point import RigPoint
    from drillctrl.explorer.rig_text import rig_as_text
    from drillctrl.strings.files import PRESETS

    if not isinstance(where, RigPoint):
        return {"rig": None, **{name: getattr(where, name) for name in _GROUPS}}
    source = point["rig"]
    preset = source in PRESETS
    strength = point["rock_strength"]
    language = where.language if where.language.units else SI
    if strength is not None:
        strength = round(language.number("stress", where.rig.rock_strength), 9)
    return {
        "rig": {
            "name": source if preset else Path(source).name,
            "text": None if preset else rig_as_text(source),
        },
        "units": language.name,
        "speed": round(30.0 / math.pi * where.rotary_speed, 9),
        "rop": round(language.number("axial_rate", where.penetration_rate), 9),
        "rock_strength": None
        if strength is None
        else round(language.number("stress", where.rig.rock_strength), 9),
    }
