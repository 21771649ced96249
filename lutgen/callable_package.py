"""Packages that are functions too: ``lutgen.lint(path)`` is a call, and ``lutgen.lint`` is also a folder of modules.

The import of a folder replaces the function of the same name in ``lutgen``. Therefore the folder itself is callable.
"""

import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any


def make_callable(package: str, function: Callable[..., Any]) -> None:
    """Make a call of an imported package a call of ``function``."""
    sys.modules[package].__class__ = type("CallablePackage", (ModuleType,), {"__call__": staticmethod(function)})
