"""Build the compiled integrator: generated physics beside the kernel modules, in a cache.

Numba caches machine code next to the source file, and looks at that file alone to tell
whether it changed. So the generated physics and the kernel modules are copied into one folder
named by a hash of all of them: a change anywhere is a new folder, and a second process finds
the machine code of the first.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import sys
import tempfile
from importlib import resources
from pathlib import Path
from types import ModuleType

from drillctrl.base.files import write_text

PACKAGE = "drillctrl.simulation.kernel"


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
    # A private folder: code is run from it, so nobody else may have put it there.
    return Path(tempfile.mkdtemp(prefix="drillctrl-"))


def kernel_sources(physics: str) -> dict[str, str]:
    """Return file name → source of the kernel package, with the physics that was generated."""
    import numba

    sources = {
        item.name: item.read_text(encoding="utf-8")
        for item in sorted(resources.files(PACKAGE).iterdir(), key=lambda item: item.name)
        if item.name.endswith(".py")
    }
    sources["physics.py"] = physics
    # Machine code of another numba must not be taken for this one's.
    sources["__init__.py"] += f"\nNUMBA_VERSION = {numba.__version__!r}\n"
    return sources


@functools.cache
def kernel(name: str, physics: str) -> ModuleType:
    """Return a module of the kernel package, compiled for a law on first use.

    Parameters
    ----------
    name : str
        Name of the module, such as ``"march"``.
    physics : str
        Source of the module of the bit's kinematics and its law; see `Structure.physics`.
    """
    package = _package(physics)
    return importlib.import_module(f"{package}.{name}")


def package_name(sources: dict[str, str]) -> str:
    """Return the name of the generated package, which changes with any of its sources."""
    text = "\0".join(f"{name}\0{source}" for name, source in sources.items())
    return f"drillctrl_kernel_{hashlib.sha256(text.encode()).hexdigest()[:16]}"


def is_compiled(physics: str) -> bool:
    """Whether an earlier run has left machine code for a law in the cache."""
    folder = cache_folder() / package_name(kernel_sources(physics))
    return any((folder / "__pycache__").glob("march*.nbc"))


@functools.cache
def _package(physics: str) -> str:
    sources = kernel_sources(physics)
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
