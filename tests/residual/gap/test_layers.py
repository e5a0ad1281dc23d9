"""Folders of the pipeline import only those below them, so that a reader can follow one way."""

import ast
from pathlib import Path

import residual.gap

FOLDERS = ["data", "model", "fitting", "preparation", "search", "confirmation", "answer"]
ABOVE = ["readings", "log", "offered", "clock", "inquiry", "find", "rows"]


def test_data_flow_one_way():
    root = Path(residual.gap.__file__).parent
    wrong = []
    for number, folder in enumerate(FOLDERS):
        for file in (root / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                module = node.module if isinstance(node, ast.ImportFrom) else None
                parts = (module or "").split(".")
                above = {*FOLDERS[number + 1 :], *ABOVE}
                if parts[:2] == ["residual", "gap"] and above & set(parts[2:3]):
                    wrong.append(f"{file.relative_to(root)} imports {module}")
    assert not wrong
