"""`_core.pyi` says what the binary has: the same names, the same parameters, the same kinds, both ways."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path

import pytest

import ipman_rs
from ipman_rs import _core

STUB = ast.parse(Path(ipman_rs.__file__).with_name("_core.pyi").read_text())


def public(names):
    return {name for name in names if not name.startswith("_")}


def functions(body):
    return {node.name: node for node in body if isinstance(node, ast.FunctionDef)}


def parameters(node):
    """The names in order, without self or cls. The binary has plain positional parameters without defaults only."""
    given = node.args
    assert not any([given.posonlyargs, given.vararg, given.kwonlyargs, given.kwarg, given.defaults])
    return [argument.arg for argument in given.args if argument.arg not in {"self", "cls"}]


def is_property(node):
    return any(isinstance(decorator, ast.Name) and decorator.id == "property" for decorator in node.decorator_list)


FUNCTIONS = functions(STUB.body)
CLASSES = {node.name: node for node in STUB.body if isinstance(node, ast.ClassDef)}


def test_same_names():
    declared = {node.target.id for node in STUB.body if isinstance(node, ast.AnnAssign)}
    assert set(_core.__all__) == {*FUNCTIONS, *CLASSES, *declared}
    assert public(dir(_core)) == public({*FUNCTIONS, *CLASSES, *declared})


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_same_parameters(name):
    signature = inspect.signature(getattr(_core, name))
    assert list(signature.parameters) == parameters(FUNCTIONS[name])
    assert all(parameter.default is parameter.empty for parameter in signature.parameters.values())
    assert FUNCTIONS[name].returns is not None, "a stub without a return type says nothing"


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_same_class(name):
    compiled, declared = getattr(_core, name), functions(CLASSES[name].body)
    assert list(inspect.signature(compiled).parameters) == parameters(declared.pop("__new__"))
    assert public(vars(compiled)) == set(declared)
    for member, node in declared.items():
        assert is_property(node) == inspect.isgetsetdescriptor(vars(compiled)[member])


def test_documented_in_both():
    """The binary's help() has no holes either."""
    for name in {*FUNCTIONS, *CLASSES}:
        assert getattr(_core, name).__doc__, name
