"""Where the elements of a compiled model stand in the text of its files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sims.mujoco import elements
from sims.mujoco.markup import Document, Markup, Tag


class Places:
    """The text of a model's files, by the elements of the compiled model.

    Args:
        document: The main file with what it includes.
        model: The compiled model.

    Attributes:
        root: The main file.
        missing: Elements that were not found, one line each.
    """

    def __init__(self, document: Document, model: Any) -> None:
        self.document, self.model = document, model
        self.root = document.files[next(iter(document.files))]
        self.missing: list[str] = []

    @property
    def degrees(self) -> bool:
        """Whether angles are written in degrees, MJCF's default."""
        angles = [
            tag.attributes["angle"]
            for _, tag in self.document.tags
            if tag.name == "compiler" and "angle" in tag.attributes
        ]
        return not angles or angles[-1] == "degree"

    def set(self, kind: str, index: int, values: dict[str, str | None]) -> None:
        """Set attributes of an element, if it is found; kinds as for ``find``."""
        found = self.find(kind, index)
        if found is not None:
            markup, tag = found
            markup.set(tag, **values)

    def find(self, kind: str, index: int) -> tuple[Markup, Tag] | None:
        """The tag of an element by its name, or by its place if it has none."""
        names, section = {
            "joint": (("joint", "freejoint"), "worldbody"),
            "body": (("body",), "worldbody"),
            "geom": (("geom",), "worldbody"),
            "actuator": ((), "actuator"),
        }[kind]
        tags = self.document.find(names, section)
        name = elements.name_of(kind, self.model, index)
        named = [found for found in tags if found[1].attributes.get("name") == name]
        if len(named) == 1:
            return named[0]
        counts = {
            "joint": self.model.njnt,
            "body": self.model.nbody - 1,
            "geom": self.model.ngeom,
            "actuator": len(self.model.actuator_trntype),
        }
        place = index - 1 if kind == "body" else index
        if len(tags) == counts[kind] and "name" not in tags[place][1].attributes:
            return tags[place]
        self.missing.append(f"{kind} {name}: not found in the text of the file")
        return None

    def files(self, name: str) -> dict[str, bytes]:
        """The text of every file that changed, by its new name."""
        main, *others = self.document.files
        self._name_folders(main)
        found = {}
        stem = Path(name).stem
        # An included file that changed is a new file, which the files around it have to name.
        for path in others:
            text = self.document.files[path].render()
            if text != self.document.files[path].text:
                found[f"{stem}-{path.name}"] = text
        for markup in self.document.files.values():
            for tag in markup.tags:
                if tag.name == "include":
                    file = main.parent / tag.attributes.get("file", "")
                    copied = f"{stem}-{file.name}"
                    markup.set(tag, file=copied if copied in found else str(file.resolve()))
        for path in others:
            if f"{stem}-{path.name}" in found:
                found[f"{stem}-{path.name}"] = self.document.files[path].render()
        return {name: self.document.files[main].render(), **found}

    def _name_folders(self, main: Path) -> None:
        """Folders of assets, in full."""
        model = self.model
        if not (model.nmesh or model.ntex or model.nhfield or model.nskin):
            return
        folder = main.parent.resolve()
        compilers = [(markup, tag) for markup, tag in self.document.tags if tag.name == "compiler"]
        if not compilers:
            self.root.insert(
                self.root.tags[0], f'\n  <compiler meshdir="{folder}" texturedir="{folder}"/>'
            )
            return
        named = set()
        for markup, tag in compilers:
            for attribute in ("assetdir", "meshdir", "texturedir"):
                if attribute in tag.attributes:
                    named.add(attribute)
                    full = str((folder / tag.attributes[attribute]).resolve())
                    markup.set(tag, **{attribute: full})
        if "assetdir" not in named:
            markup, tag = compilers[0]
            for attribute in {"meshdir", "texturedir"} - named:
                markup.set(tag, **{attribute: str(folder)})
