"""Options whose words are joined by a hyphen where the parser has an underscore, or the reverse."""

from __future__ import annotations

from collections.abc import Container, Sequence


def spelled(words: Sequence[str], options: Container[str]) -> list[str]:
    """The words of a command line, its options spelt as the parser knows them.

    ``--held_out`` is ``--held-out``, and ``--parameter-tolerance`` is ``--parameter_tolerance``;
    what is an option in neither spelling is left as it is.
    """
    found = []
    for word in words:
        name, equals, value = word.partition("=")
        bare = name.removeprefix("--")
        others = (f"--{bare.replace('-', '_')}", f"--{bare.replace('_', '-')}")
        if name.startswith("--") and name not in options:
            name = next((other for other in others if other in options), name)
        found.append(f"{name}{equals}{value}")
    return found
