"""Build the compiled integrator and the laws that it calls, in a cache.

Numba caches machine code next to the source file, and looks at that file alone to tell
whether it changed. So the kernel modules and the generated kinematics are copied into one
folder named by a hash of all of them: a change anywhere is a new folder, and a second process
finds the machine code of the first. A law has a folder of its own, so the kernel is compiled
once for all of them.
"""

from __future__ import annotations

import atexit
import functools
import hashlib
import importlib.util
import logging
import os
import sys
import tempfile
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from types import ModuleType

from drillctrl.base.files import write_text
from drillctrl.drilling.motion import kinematic_functions
from drillctrl.simulation.translate import module_of, translate

logger = logging.getLogger("drillctrl")
PACKAGE = "drillctrl.simulation.kernel"
# The law as the kernel calls it; see `kernel.law`.
CALLED = """

@numba.cfunc(
    "void(f8, f8, f8, f8, f8, CPointer(f8), CPointer(f8))", cache=True, error_model="numpy"
)
def law(depth, pressed, sign, axial, rotary, q, loads):
    loads[0], loads[1] = load((depth, pressed, sign), (axial, rotary), q)
"""


def cache_folder() -> Path:
    """Return the folder for generated code, made if it is missing.

    It is ``$DRILLCTRL_CACHE``, else ``$XDG_CACHE_HOME/drillctrl``, else
    ``~/.cache/drillctrl``; where that cannot be written to, one in the temporary folder.
    """
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    wanted = Path(os.environ.get("DRILLCTRL_CACHE") or os.path.join(home, "drillctrl"))
    try:
        wanted.mkdir(mode=0o700, parents=True, exist_ok=True)
        if os.access(wanted, os.W_OK):
            return wanted
    except OSError:
        pass
    return _private_folder()


@functools.cache
def _private_folder() -> Path:
    """Return a folder that goes with the process: code is run from it, so no one else may write."""
    folder = tempfile.TemporaryDirectory(prefix="drillctrl-", ignore_cleanup_errors=True)
    atexit.register(folder.cleanup)
    return Path(folder.name)


def kernel_sources() -> dict[str, str]:
    """Return file name → source of the kernel package, with the kinematics that are generated."""
    sources = {
        item.name: item.read_text(encoding="utf-8")
        for item in sorted(resources.files(PACKAGE).iterdir(), key=lambda item: item.name)
        if item.name.endswith(".py")
    }
    sources["physics.py"] = module_of(translate(function) for function in kinematic_functions())
    return sources


def package_name(sources: dict[str, str]) -> str:
    """Return the name of a generated package, which changes with any of its sources."""
    import numba

    # Machine code of another numba must not be taken for this one's.
    text = "\0".join([numba.__version__, *(f"{name}\0{sources[name]}" for name in sources)])
    return f"drillctrl_kernel_{hashlib.sha256(text.encode()).hexdigest()[:16]}"


@functools.cache
def kernel(name: str) -> ModuleType:
    """Return a module of the kernel package, such as ``"march"``, compiled on first use."""
    return importlib.import_module(f"{_kernel_package()}.{name}")


@functools.cache
def _kernel_package() -> str:
    sources = kernel_sources()
    folder = cache_folder() / package_name(sources)
    if not any((folder / "__pycache__").glob("march*.nbc")):
        logger.info("compiling the simulator, once, in about 40 s ...")
    return _import_package(sources)


class Address(int):
    """Where the machine code of a law is in this process; in another one it is elsewhere."""

    source: str

    def __reduce__(self) -> tuple[Callable[[str], Address], tuple[str]]:
        return law_address, (self.source,)


@functools.cache
def law_address(source: str) -> Address:
    """Return where the machine code of a law is, compiled on first use.

    Parameters
    ----------
    source : str
        Of its function; see `Structure.law`.
    """
    package = _import_package({"__init__.py": "", "law.py": module_of([source]) + CALLED})
    address = Address(importlib.import_module(f"{package}.law").law.address)
    address.source = source
    return address


def _import_package(sources: dict[str, str]) -> str:
    package = package_name(sources)
    folder = cache_folder() / package
    folder.mkdir(mode=0o700, exist_ok=True)
    for name, source in sources.items():
        if not (folder / name).exists():
            write_text(folder / name, source)
    spec = importlib.util.spec_from_file_location(
        package, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[package] = module
    spec.loader.exec_module(module)
    return package
