"""Examples of a page: read, written to files, and run without importing everything anew."""

import contextlib
import io
import re
import runpy

import pytest


def blocks(page, language):
    """The page's examples in a language."""
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


def write_examples(page, folder):
    """Put the page's Python into files, of the name that stands in the first line of each."""
    for code in blocks(page, "python"):
        (folder / code.splitlines()[0].removeprefix("# ")).write_text(code)


@contextlib.contextmanager
def inside(folder):
    """In a folder, as for whoever starts Python there; gives what is printed."""
    with (
        pytest.MonkeyPatch.context() as patch,
        contextlib.redirect_stdout(io.StringIO()) as printed,
    ):
        patch.chdir(folder)
        patch.syspath_prepend(folder)
        yield printed


def script(name, folder):
    """What a script prints that is started in a folder."""
    with inside(folder) as printed:
        runpy.run_path(name, run_name="__main__")
    return printed.getvalue()
