"""Where files that a model names were expected, for those that are not there."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree


def missing_include(path: Path) -> str:
    """Where the first included file that is not there was expected; nothing if all are there.

    Those that included files name count, too; MuJoCo looks all of them up beside the main file.
    """
    beside, known = path.parent.resolve(), {path.resolve()}
    files = [path.resolve()]
    for file in files:
        try:
            tags = list(ElementTree.parse(file).iter("include"))
        except ElementTree.ParseError:
            continue
        for tag in tags:
            wanted = (beside / tag.get("file", "")).resolve()
            if not wanted.exists():
                return f": expected it at {wanted}"
            if wanted.is_file() and wanted not in known:
                known.add(wanted)
                files.append(wanted)
    return ""


def missing_asset(spec: Any, path: Path) -> str:
    """Where the first file that a model lacks was expected; nothing if all are there."""
    beside = path.parent.resolve()
    meshes, pictures = beside / spec.compiler.meshdir, beside / spec.compiler.texturedir
    for folder, assets in ((meshes, spec.meshes), (pictures, (*spec.textures, *spec.hfields))):
        for asset in assets:
            name = Path(asset.file).name if spec.strippath else asset.file
            if name.startswith("package://"):
                package, _, rest = name.removeprefix("package://").partition("/")
                return f": expected {package}/{rest} in a folder above {beside}"
            if name and not (folder / name).is_file():
                return f": expected it at {folder / name}"
    return ""
