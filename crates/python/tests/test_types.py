"""Types and documentation as a reader of the module relies on them."""

from __future__ import annotations

import inspect
import subprocess
import sys
from pathlib import Path
from typing import Any

import chainwave as cw
import pytest

PACKAGE = Path(cw.__file__).parent


def said_by(*words: str | Path) -> str:
    """What a module of Python says; it must succeed."""
    # Elsewhere than among the installed packages, which would be taken for a program's own modules.
    ended = subprocess.run([sys.executable, "-m", *words], capture_output=True, text=True, cwd=Path(__file__).parent)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


def test_stubs_are_those_of_the_module() -> None:
    pytest.importorskip("mypy")
    said_by("mypy.stubtest", "chainwave._chainwave")


def test_pyright_accepts_the_module() -> None:
    pytest.importorskip("pyright")
    try:
        said_by("pyright", "--version")
    except AssertionError:
        pytest.skip("pyright was installed, but cannot be started here (it needs node)")
    assert "0 errors" in said_by("pyright", "--pythonpath", sys.executable, PACKAGE)


FUNCTIONS = [(name, value) for name, value in vars(cw).items() if inspect.isfunction(value) and name in cw.__all__]
METHODS = [
    (f"{name}.{of}", method)
    for name, value in vars(cw).items()
    if inspect.isclass(value) and name in cw.__all__
    for of, method in vars(value).items()
    if inspect.isfunction(method) and not of.startswith("_")
]


@pytest.mark.parametrize(("name", "value"), FUNCTIONS + METHODS, ids=[name for name, _ in FUNCTIONS + METHODS])
def test_every_argument_is_documented_in_the_style_of_numpy(name: str, value: Any) -> None:
    told = inspect.getdoc(value) or ""
    assert told, f"{name} has no documentation"
    arguments = [argument for argument in inspect.signature(value).parameters if argument not in ("self", "cls")]
    # A method that only goes on from another one, or a column by its name, needs no list.
    if len(arguments) < 2 or "As :meth:" in told:
        return
    heads = [line.split(":")[0] for line in told.splitlines() if not line.startswith(" ")]
    listed = {word.strip(" *") for head in heads for word in head.split(",")}
    assert "Parameters\n----------" in told and set(arguments) <= listed, f"{name}: {set(arguments) - listed}"


@pytest.mark.parametrize(("name", "value"), FUNCTIONS, ids=[name for name, _ in FUNCTIONS])
def test_every_function_says_what_comes_back(name: str, value: Any) -> None:
    assert "Returns\n-------" in (inspect.getdoc(value) or ""), name
