"""Scripts of a page, run without a process that imports everything anew."""

import contextlib
import io
import runpy

import pytest


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
