"""The command line: one verb for each thing that the package does."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from drillctrl.errors import InputError

if TYPE_CHECKING:
    from drillctrl.designing import Design
    from drillctrl.operating_point import OperatingPoint, RigPoint

Command = TypeVar("Command", bound=Callable[..., Any])

NOT_STABILISED = 3
BAD_INPUT = 2
_DIMENSIONLESS = (
    "omega0",
    "delta0",
    "psi",
    "eta",
    "xi",
    "kappa",
    "damping",
    "blades",
    "lam",
    "beta",
)
_RIG = ("rig", "speed", "rop", "wob", "rock_strength")
_POINT_C = {"omega0": 10.0, "delta0": 1.75, "psi": 14.0}


def _point_options(command: Command) -> Command:
    """Add the options that say where the rig drills."""
    options = [
        click.option("--omega0", type=float, help="Rotary speed ω0 (default 10)."),
        click.option("--delta0", type=float, help="Nominal depth of cut δ0 (default 1.75)."),
        click.option("--psi", type=float, help="Cutting coefficient ψ (default 14)."),
        click.option("--eta", type=float, help="Frequency ratio η (default 1.6)."),
        click.option("--xi", type=float, help="Axial damping ratio ξ (default 0.02)."),
        click.option("--kappa", type=float, help="Torsional damping ratio κ (default 0.02)."),
        click.option("--damping", type=float, help="Sets ξ and κ together."),
        click.option("--blades", type=float, help="Number of blades n (default 4)."),
        click.option("--lam", type=float, help="Wear-flat force λ (default 0.7461 ψ)."),
        click.option("--beta", type=float, help="Wear-flat torque β (default 0.2686)."),
        click.option("--rig", help="Preset (table1) or TOML file, instead of the above."),
        click.option("--speed", help="Rotary speed with its unit, such as '120 rpm'."),
        click.option("--rop", help="Rate of penetration with its unit, such as '20 m/h'."),
        click.option("--wob", help="Weight on bit instead of --rop, such as '20 kN'."),
        click.option("--rock-strength", help="Instead of the rig's own, such as '60 MPa'."),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def _output_options(command: Command) -> Command:
    """Add the options that say where results go."""
    options = [
        click.option("--prove", is_flag=True, help="Prove the root count in ball arithmetic."),
        click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead."),
        click.option("--out", type=click.Path(), help="Also write the JSON to FILE.json."),
        click.option("--plot", type=click.Path(), help="Draw the roots: FILE.png, .svg, .pdf."),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def read_point(options: dict[str, Any]) -> OperatingPoint | RigPoint:
    """Return the point that the options name.

    Raises
    ------
    InputError
        If dimensionless and rig options are mixed, or one is missing or wrong.
    """
    groups = {k: options[k] for k in _DIMENSIONLESS if options.get(k) is not None}
    rig = {k: options[k] for k in _RIG if options.get(k) is not None}
    if groups and rig:
        first = next(iter(groups))
        raise InputError(
            f"--{first}",
            groups[first],
            f"left out where --{next(iter(rig)).replace('_', '-')} gives the point in rig units",
        )
    return _rig_point(rig) if rig else _operating_point(groups)


def _operating_point(groups: dict[str, Any]) -> OperatingPoint:
    from drillctrl.operating_point import OperatingPoint

    values = {**_POINT_C, **groups}
    damping = values.pop("damping", None)
    if damping is not None:
        for name in ("xi", "kappa"):
            if name in groups:
                raise InputError(f"--{name}", groups[name], "left out where --damping is given")
            values[name] = damping
    return OperatingPoint(**values)


def _rig_point(given: dict[str, Any]) -> RigPoint:
    from drillctrl import units
    from drillctrl.operating_point import RigPoint
    from drillctrl.rig import load_rig
    from drillctrl.steady_state import rig_point_at_weight_on_bit

    for name, permitted in (("rig", "a preset or a TOML file"), ("speed", "such as '120 rpm'")):
        if name not in given:
            raise InputError(f"--{name}", "(missing)", f"given, {permitted}")
    if ("rop" in given) == ("wob" in given):
        shown = given.get("rop", "(missing)")
        raise InputError("--rop", shown, "given, such as '20 m/h', or else --wob, one of the two")
    rig = load_rig(given["rig"])
    if "rock_strength" in given:
        strength = units.to_si("--rock-strength", given["rock_strength"], units.STRESS)
        rig = rig.with_rock_strength(strength)
    speed = units.to_si("--speed", given["speed"], units.ROTARY_SPEED)
    if "wob" in given:
        return rig_point_at_weight_on_bit(
            rig, speed, units.to_si("--wob", given["wob"], units.FORCE)
        )
    return RigPoint(rig, speed, units.to_si("--rop", given["rop"], units.SPEED))


def read_bounds(texts: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    """Return bounds by gain from texts such as ``K1=-10:10``."""
    bounds = {}
    for text in texts:
        name, _, interval = text.partition("=")
        low, _, high = interval.partition(":")
        try:
            bounds[name.strip()] = (float(low), float(high))
        except ValueError:
            raise InputError("--bound", text, "of the form K1=-10:10") from None
    return bounds


def read_gains(name: str, text: str | None) -> list[float] | None:
    """Return a flat list of gains from a text such as ``-5.03,-4.91``."""
    if text is None:
        return None
    try:
        return [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise InputError(f"--{name}", text, "numbers with commas between them") from None


def _writing(parameter: str, path: str, write: Callable[[], None]) -> None:
    """Write a file, turning what the system refuses into a message about the option."""
    try:
        write()
    except OSError as error:
        raise InputError(
            parameter, path, f"a file that can be written ({error.strerror})"
        ) from None


def _check_folder(parameter: str, path: str | None) -> None:
    if path is not None and not Path(path).absolute().parent.is_dir():
        raise InputError(parameter, path, "in a folder that exists")


def _check_outputs(out: str | None, plot: str | None) -> None:
    """Refuse bad file names before any work is done."""
    _check_folder("--out", out)
    _check_folder("--plot", plot)
    if out is not None and Path(out).suffix.lower() != ".json":
        raise InputError("--out", out, "a file that ends in .json")
    if plot is not None:
        from drillctrl.plotting import check_figure_path

        check_figure_path(plot)


def _deliver(result: Design, prove: bool, as_json: bool, out: str | None, plot: str | None) -> None:
    proof = result.prove() if prove else None
    text = ""
    if as_json or out is not None:
        fields = result.to_dict()
        if proof is not None:
            fields["certificate"]["proof"] = dataclasses.asdict(proof)
        text = json.dumps(fields, indent=2, allow_nan=False, ensure_ascii=False)
    if out is not None:
        from drillctrl.files import write_text

        _writing("--out", out, lambda: write_text(out, text + "\n"))
    if plot is not None:
        from drillctrl.plotting import save_figure

        figure = result.plot().get_figure(root=True)
        assert figure is not None
        _writing("--plot", plot, lambda: save_figure(figure, plot))
    click.echo(text if as_json else result.summary())
    if proof is not None and not as_json:
        counted = "undecided" if proof.count is None else f"{proof.count} root(s)"
        click.echo(
            f"Proved: {counted} right of {proof.line:.6g}, "
            f"{proof.segments} segments in {proof.precision}-bit balls"
        )


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="drillctrl")
def cli() -> None:
    """Design bounded delayed feedback that keeps a rotary drill string from vibrating.

    Where the rig drills is given by dimensionless groups (--omega0 --delta0 --psi) or by a
    rig (--rig --speed --rop). With neither, it is ω0 = 10, δ0 = 1.75, ψ = 14.
    """


@cli.command(name="design")
@_point_options
@click.option(
    "--structure",
    default="case1",
    show_default=True,
    help="p: θ; case1: θ and delayed θ; pd: θ, θ'; case2: θ, θ', both also delayed.",
)
@click.option(
    "--bound",
    multiple=True,
    metavar="GAIN=LOW:HIGH",
    help="For K1, K2 or one gain such as K1_2; may be repeated.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the starting points.")
@click.option("--require-stable", is_flag=True, help="Exit with 3 if nothing stabilises.")
@_output_options
def design_command(
    structure: str,
    bound: tuple[str, ...],
    seed: int,
    require_stable: bool,
    prove: bool,
    as_json: bool,
    out: str | None,
    plot: str | None,
    **point: Any,
) -> None:
    """Find the gains within bounds that make vibrations decay fastest.

    \b
    Examples:
      drillctrl design --rig table1 --speed "150 rpm" --rop "20 m/h" --structure case2
      drillctrl design --omega0 10 --delta0 12 --psi 14 --bound K1=-5:5 --json
    """
    _check_outputs(out, plot)
    where = read_point(point)
    from drillctrl.designing import design

    result = design(where, structure, bounds=read_bounds(bound), seed=seed)
    _deliver(result, prove, as_json, out, plot)
    if require_stable and not result.stable:
        raise click.exceptions.Exit(NOT_STABILISED)


@cli.command(name="analyze")
@_point_options
@click.option("--structure", help="p, case1, pd or case2; without it, the open loop.")
@click.option("--K1", "k1", metavar="GAINS", help="On the outputs, such as -5.03,-4.91.")
@click.option("--K2", "k2", metavar="GAINS", help="On the delayed outputs.")
@click.option("--m", type=int, help="Intervals of the semi-discretisation reported.")
@click.option("--order", type=int, default=2, show_default=True, help="Its order: 0, 1 or 2.")
@click.option("--require-stable", is_flag=True, help="Exit with 3 if the loop is not stable.")
@_output_options
def analyze_command(
    structure: str | None,
    k1: str | None,
    k2: str | None,
    m: int | None,
    order: int,
    require_stable: bool,
    prove: bool,
    as_json: bool,
    out: str | None,
    plot: str | None,
    **point: Any,
) -> None:
    """Say whether given gains, or none, make a point stable, and by how much.

    \b
    Examples:
      drillctrl analyze --omega0 10 --delta0 1.75 --psi 14
      drillctrl analyze --structure case1 --K1 -5.17 --K2 5.06 --m 3 --order 0
    """
    _check_outputs(out, plot)
    where = read_point(point)
    from drillctrl.designing import analyze

    gains = read_gains("K1", k1), read_gains("K2", k2)
    result = analyze(where, structure, *gains, m=m, order=order)
    _deliver(result, prove, as_json, out, plot)
    if require_stable and not result.stable:
        raise click.exceptions.Exit(NOT_STABILISED)


def read_initial(text: str) -> dict[str, float]:
    """Return a perturbation from a text such as ``dx=1,dtheta=1``; empty for none."""
    initial = {}
    for part in filter(None, (piece.strip() for piece in text.split(","))):
        name, _, value = part.partition("=")
        try:
            initial[name.strip()] = float(value)
        except ValueError:
            raise InputError("--initial", text, "of the form dx=1,dtheta=1") from None
    return initial


@cli.command(name="simulate")
@_point_options
@click.option("--structure", help="p, case1, pd or case2; without it, no control.")
@click.option("--K1", "k1", metavar="GAINS", help="On the outputs, such as -5.03,-4.91.")
@click.option("--K2", "k2", metavar="GAINS", help="On the delayed outputs.")
@click.option("--activation", type=float, default=0.0, help="Time at which control begins.")
@click.option("--model", default="nonlinear", show_default=True, help="nonlinear or linear.")
@click.option(
    "--cutting",
    default="multiple",
    show_default=True,
    help="Rock face: multiple (deepest of all passes) or single (the last pass).",
)
@click.option("--duration", type=float, default=200.0, show_default=True, help="Time units.")
@click.option(
    "--initial",
    default="dx=1,dtheta=1",
    show_default=True,
    help="Perturbation of steady drilling: x, dx, theta, dtheta.",
)
@click.option("--rtol", type=float, default=1e-8, show_default=True, help="Relative error.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
@click.option("--out", type=click.Path(), help="Motion: FILE.csv, .npz or .parquet.")
@click.option("--plot", type=click.Path(), help="Draw the motion: FILE.png, .svg, .pdf.")
def simulate_command(
    structure: str | None,
    k1: str | None,
    k2: str | None,
    activation: float,
    model: str,
    cutting: str,
    duration: float,
    initial: str,
    rtol: float,
    as_json: bool,
    out: str | None,
    plot: str | None,
    **point: Any,
) -> None:
    """Try gains, or none, on the nonlinear drill string: stick, slip and bounce.

    \b
    Examples:
      drillctrl simulate --omega0 10 --delta0 2.5 --psi 14 --duration 200 --plot motion.png
      drillctrl simulate --delta0 2.5 --structure case1 --K1 -3.82 --K2 3.61 --out motion.csv
    """
    _check_folder("--out", out)
    _check_folder("--plot", plot)
    where = read_point(point)
    from drillctrl.simulation import Controller, simulate
    from drillctrl.simulation.build import is_compiled
    from drillctrl.simulation.export import check_export_path, export_motion
    from drillctrl.simulation.report import simulation_fields, simulation_summary

    if out is not None:
        check_export_path(out)
    if plot is not None:
        from drillctrl.plotting import check_figure_path

        check_figure_path(plot)
    from drillctrl.operating_point import RigPoint

    rig_point = where if isinstance(where, RigPoint) else None
    groups = where.operating_point() if isinstance(where, RigPoint) else where
    controller = None
    if structure is not None:
        gains = read_gains("K1", k1), read_gains("K2", k2)
        if gains[0] is None:
            raise InputError("--K1", "(missing)", f"given for structure {structure}")
        controller = Controller(structure, gains[0], gains[1], activation=activation)
    elif k1 is not None or k2 is not None:
        raise InputError("--structure", "(missing)", "given together with gains")
    if not is_compiled():
        click.echo("drillctrl: compiling the simulator, once, in about 20 s ...", err=True)
    run = simulate(
        groups,
        controller,
        duration=duration,
        initial=read_initial(initial),
        model=model,
        cutting=cutting,
        rtol=rtol,
    )
    if out is not None:
        _writing("--out", out, lambda: export_motion(run, out))
    if plot is not None:
        from drillctrl.plotting import save_figure
        from drillctrl.simulation.plotting import plot_motion

        figure = plot_motion(run)
        _writing("--plot", plot, lambda: save_figure(figure, plot))
    if as_json:
        click.echo(json.dumps(simulation_fields(run), indent=2, allow_nan=False))
    else:
        click.echo(simulation_summary(run, rig_point))


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit with its status."""
    try:
        status = cli.main(arguments, prog_name="drillctrl", standalone_mode=False)
    except InputError as error:
        _fail(str(error))
    except click.UsageError as error:
        _fail(" ".join(error.format_message().split()))
    except click.exceptions.Abort:
        click.echo("drillctrl: interrupted", err=True)
        sys.exit(130)
    sys.exit(status if isinstance(status, int) else 0)


def _fail(message: str) -> None:
    click.echo(f"drillctrl: {message}", err=True)
    sys.exit(BAD_INPUT)
