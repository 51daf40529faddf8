"""What a route calls, followed through the application's own functions by their names."""

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterator
from typing import Any


def reaches(endpoint: Callable[..., Any], goal: Callable[..., Any]) -> bool:
    """Whether an endpoint calls a function, itself or by what it calls."""
    waiting, seen = [inspect.unwrap(endpoint)], set()
    while waiting:
        function = waiting.pop()
        if function is goal:
            return True
        module = getattr(function, "__module__", None) or ""
        if not (inspect.isfunction(function) and module.startswith("app.")) or function in seen:
            continue
        seen.add(function)
        waiting += [inspect.unwrap(part) for part in _called(function) if callable(part)]
    return False


def _called(function: Callable[..., Any]) -> Iterator[Any]:
    """Give what a function calls, as far as its names tell."""
    names = function.__globals__
    for node in ast.walk(ast.parse(textwrap.dedent(inspect.getsource(function)))):
        if isinstance(node, ast.Name):
            yield names.get(node.id)
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            yield getattr(names.get(node.value.id), node.attr, None)
