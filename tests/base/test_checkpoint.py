import shutil
import sys
from pathlib import Path

import pytest

import drillctrl
from drillctrl import Checkpoint, InputError
from drillctrl.base import checkpoint as module
from drillctrl.base.checkpoint import source_digest

PACKAGE = Path(drillctrl.__file__).parent


def test_results_of_another_source_are_other_results(tmp_path):
    copy = tmp_path / "drillctrl"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    same = tmp_path / "same"
    shutil.copytree(copy, same)
    assert source_digest(same) == source_digest(PACKAGE)
    for number, changed in enumerate(("spectrum/roots.py", "simulation/kernel/march.py")):
        other = tmp_path / f"other{number}"
        shutil.copytree(copy, other)
        with (other / changed).open("a") as file:
            file.write("\n")
        assert source_digest(other) != source_digest(PACKAGE)
    # What is only shown or printed computes nothing.
    for shown in ("cli/table.py", "tables/figure.py", "tables/templates/controller.c.j2"):
        (copy / shown).write_text("")
    assert source_digest(copy) == source_digest(PACKAGE)


@pytest.mark.parametrize("name", ["numpy", "scipy", "casadi", "numba", "drillctrl"])
def test_results_of_another_library_are_refused_and_left_alone(name, tmp_path, monkeypatch):
    path = tmp_path / "campaign.checkpoint"
    with Checkpoint(path) as kept:
        kept.keep("a", {"b": 1})
    content = path.read_bytes()
    version = module.version
    monkeypatch.setattr(module, "version", lambda of: "99.9" if of == name else version(of))
    with pytest.raises(InputError, match=f"a checkpoint of .*{name} 99.9") as caught:
        Checkpoint(path)
    assert str(caught.value).count("\n") == 0
    assert path.read_bytes() == content
    monkeypatch.undo()
    with Checkpoint(path) as again:
        assert again.find("a") == {"b": 1}


@pytest.mark.skipif(sys.platform == "win32", reason="no locks of this kind")
def test_two_runs_are_not_at_one_checkpoint(tmp_path):
    path = tmp_path / "table.checkpoint"
    with Checkpoint(path) as first:
        first.keep("a", {"b": 1})
        with pytest.raises(InputError, match="no other run"):
            Checkpoint(path)
        first.keep("c", {"d": 2})
    with Checkpoint(path) as again:
        assert (again.find("a"), again.find("c")) == ({"b": 1}, {"d": 2})
