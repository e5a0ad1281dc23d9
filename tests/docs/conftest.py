"""Tutorials' files run where pytest runs, and several tutorials call theirs alike."""

import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="module", autouse=True)
def own_modules(tmp_path_factory):
    """What the scripts of a page import: the next page has other files of the same names."""
    yield
    folder = tmp_path_factory.getbasetemp()
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if file and folder in Path(file).parents:
            del sys.modules[name]


@pytest.fixture
def here(folder, monkeypatch):
    """In the folder of a page's files, as for whoever starts Python there."""
    monkeypatch.syspath_prepend(folder)
    monkeypatch.chdir(folder)
    return folder
