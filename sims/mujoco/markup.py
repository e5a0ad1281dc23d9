"""An XML file whose attributes are changed in its text, so that all else stays as it was."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from pathlib import Path
from xml.parsers import expat


@dataclasses.dataclass
class Tag:
    """A start tag in the text of a file.

    Attributes:
        name: ``"joint"``.
        attributes: As written.
        start, end: Bytes of the start tag in its file.
        parents: Names of the tags around it, outermost first.
        parent: The tag right around it; None for the root.
    """

    name: str
    attributes: dict[str, str]
    start: int
    end: int
    parents: tuple[str, ...]
    parent: Tag | None

    def __hash__(self) -> int:
        return id(self)


class Markup:
    """The text of one XML file and the changes to be made to it.

    Args:
        text: UTF-8.
    """

    def __init__(self, text: bytes) -> None:
        self.text = text
        self.tags = list(_tags(text))
        self._set: dict[Tag, dict[str, str | None]] = {}
        self._renamed: dict[Tag, str] = {}
        self._inside: dict[Tag, list[str]] = {}

    def set(self, tag: Tag, **values: str | None) -> None:
        """Set attributes of a tag; None takes one away."""
        self._set.setdefault(tag, {}).update(values)

    def now(self, tag: Tag, attribute: str) -> str | None:
        """An attribute with the changes so far."""
        return self._set.get(tag, {}).get(attribute, tag.attributes.get(attribute))

    def rename(self, tag: Tag, name: str) -> None:
        """Give a tag without content another name."""
        self._renamed[tag] = name

    def insert(self, tag: Tag, content: str) -> None:
        """Put text right after a start tag."""
        self._inside.setdefault(tag, []).append(content)

    def children(self, tag: Tag, name: str) -> list[Tag]:
        """Tags of a name right inside a tag."""
        return [child for child in self.tags if child.parent is tag and child.name == name]

    def render(self) -> bytes:
        """The text with all changes."""
        text = self.text
        touched = {*self._set, *self._renamed, *self._inside}
        for tag in sorted(touched, key=lambda tag: -tag.start):
            own = text[tag.start : tag.end].decode()
            for attribute, value in self._set.get(tag, {}).items():
                own = _with_attribute(own, attribute, value)
            if tag in self._renamed:
                own = f"<{self._renamed[tag]}{own[1 + len(tag.name) :]}"
            content = "".join(self._inside.get(tag, []))
            closing = b""
            if content and own.endswith("/>"):
                own, closing = own[:-2] + ">", f"</{tag.name}>".encode()
            elif tag in self._renamed and not own.endswith("/>"):
                end = text.index(b">", text.index(f"</{tag.name}".encode(), tag.end)) + 1
                return_to = text[end:]
                text = text[: tag.end] + f"</{self._renamed[tag]}>".encode() + return_to
            text = text[: tag.start] + own.encode() + content.encode() + closing + text[tag.end :]
        return text


def _with_attribute(tag: str, attribute: str, value: str | None) -> str:
    written = re.compile(rf"""(\s+){re.escape(attribute)}\s*=\s*("[^"]*"|'[^']*')""")
    if value is None:
        return written.sub("", tag, count=1)
    if written.search(tag):
        return written.sub(lambda m: f'{m[1]}{attribute}="{value}"', tag, count=1)
    end = re.search(r"\s*/?>$", tag)
    assert end is not None
    return f'{tag[: end.start()]} {attribute}="{value}"{tag[end.start() :]}'


def _tags(text: bytes) -> Iterator[Tag]:
    parser = expat.ParserCreate("utf-8")
    found: list[Tag] = []
    stack: list[Tag] = []

    def start(name: str, attributes: dict[str, str]) -> None:
        at = parser.CurrentByteIndex
        end = at + _length(text[at:])
        around = tuple(tag.name for tag in stack)
        tag = Tag(name, attributes, at, end, around, stack[-1] if stack else None)
        found.append(tag)
        stack.append(tag)

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: stack.pop()
    parser.Parse(text, True)
    yield from found


def _length(text: bytes) -> int:
    """Bytes of the start tag that the text begins with; a '>' in quotes does not end it."""
    found = re.match(rb"""<(?:[^>"']|"[^"]*"|'[^']*')*>""", text)
    assert found is not None
    return found.end()


@dataclasses.dataclass
class Document:
    """A model file with the files that it includes.

    Attributes:
        files: By path, the main file first.
        tags: All tags in the order in which MuJoCo reads them, each with its file.
    """

    files: dict[Path, Markup]
    tags: list[tuple[Markup, Tag]]

    @classmethod
    def read(cls, path: Path, text: bytes | None = None) -> Document:
        """The document of a main file.

        Args:
            path: The main file; includes are looked up in its folder, as MuJoCo does.
            text: Its text, if it is not that of the file.
        """
        files: dict[Path, Markup] = {}
        tags: list[tuple[Markup, Tag]] = []

        def add(file: Path, content: bytes, around: tuple[str, ...]) -> None:
            markup = files[file] = Markup(content)
            for tag in markup.tags:
                if around and tag.parent is None:
                    continue  # the root of an included file stands for nothing
                if around:
                    tag.parents = (*around, *tag.parents[1:])
                if tag.name == "include":
                    inner = path.parent / tag.attributes.get("file", "")
                    if inner.is_file():
                        add(inner, inner.read_bytes(), tag.parents)
                    continue
                tags.append((markup, tag))

        add(path, path.read_bytes() if text is None else text, ())
        return cls(files, tags)

    def find(self, names: tuple[str, ...], inside: str) -> list[tuple[Markup, Tag]]:
        """Tags of some names inside a section, ``"worldbody"`` or ``"actuator"``."""
        return [
            (markup, tag)
            for markup, tag in self.tags
            if (tag.name in names or not names)
            and len(tag.parents) > 1
            and tag.parents[1] == inside
        ]
