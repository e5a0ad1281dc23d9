"""The parameters of a system as its author sees them."""

from __future__ import annotations

import difflib
from types import SimpleNamespace
from typing import NoReturn


class Values(SimpleNamespace):
    """Parameters as attributes, ``p.mass``; one that there is not is told with those that are."""

    def __getattr__(self, name: str) -> NoReturn:
        there = ", ".join(vars(self)) or "none"
        near = difflib.get_close_matches(name, vars(self), 1)
        hint = f"did you mean {near[0]!r}?" if near else f"there is {there}"
        raise AttributeError(f"no parameter {name!r}; {hint}")
