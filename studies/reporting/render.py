"""Templates: files in ``templates/``, HTML for each section and Markdown, filled in by Jinja2."""

from __future__ import annotations

import functools
import math
import re
from typing import Any

import jinja2
from markupsafe import Markup, escape

_INLINE = (
    (re.compile(r"\*\*(\S(?:.*?\S)?)\*\*"), r"<strong>\1</strong>"),
    # An option stays on one line: a browser would break it behind its first hyphen.
    (re.compile(r"(?<![\w-])(--[a-z][\w-]*)"), r'<span class="option">\1</span>'),
    (re.compile(r"\[([^\]]+)\]\(((?:https?://|#)[^\s)]+)\)"), r'<a href="\2">\1</a>'),
)
# A number stays on one line with its unit.
_UNIT = re.compile(r"(?<=\d) (?=[A-Za-zµ°%])|(?<=\bN) (?=m\b)|(?<=\bm) (?=s\b)|(?<=\bkg) (?=m)")
# A hyphen that begins a number, at the start, after a space, a bracket or a tag, is a minus; one in
# an address is not.
_MINUS = re.compile(r"(?<![^\s(>])-(?=\.?\d)")
_CODE = re.compile(r"`([^`]+)`")


def render(template: str, **values: Any) -> Markup:
    """Fill in one template of ``templates/``; in HTML all but ``Markup`` is escaped.

    Raises:
        jinja2.UndefinedError: The template uses a value that is not given.
    """
    return Markup(_environment().get_template(template).render(**values))


def inline(text: str) -> Markup:
    """One line of text with ``**strong**``, ```` `code` ```` and ``[words](address)`` marked up."""
    pieces = _CODE.split(str(escape(text)))
    for even in range(0, len(pieces), 2):
        for pattern, replacement in _INLINE:
            pieces[even] = pattern.sub(replacement, pieces[even])
        pieces[even] = _UNIT.sub("\u00a0", _MINUS.sub("\u2212", pieces[even]))
    for odd in range(1, len(pieces), 2):
        pieces[odd] = f"<code>{pieces[odd]}</code>"
    return Markup("".join(pieces))


def paragraphs(text: str) -> Markup:
    """Text as paragraphs, parted by blank lines; lines that begin with ``- `` become a list."""
    html = []
    for block in re.split(r"\n\s*\n", text.strip()):
        words: list[str] = []
        items: list[str] = []
        for line in map(str.strip, block.splitlines()):
            if line.startswith("- "):
                items.append(line[2:])
            elif items:
                items[-1] += f" {line}"
            else:
                words.append(line)
        if words:
            html.append(f"<p>{inline(' '.join(words))}</p>")
        if items:
            html.append("<ul>" + "".join(f"<li>{inline(item)}</li>" for item in items) + "</ul>")
    return Markup("\n".join(html))


def number(value: Any, digits: int = 3) -> str:
    """A cell of a table as text: ``digits`` significant digits, a true minus, a dash for nothing.

    Floats keep their trailing zeros, so that a column shows the precision it has.
    """
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        text = f"{value:,}".replace(",", "\u2009") if abs(value) >= 10_000 else str(value)
    elif isinstance(value, float):
        text = _float(value, digits)
    else:
        return str(value)
    return text.replace("-", "\u2212")


def _float(value: float, digits: int) -> str:
    if math.isinf(value):
        return "∞" if value > 0 else "-∞"
    if value == 0:
        return "0"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = int(exponent)
    if not -4 <= power < max(digits, 6):
        superscript = str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
        return f"{mantissa}\u202f×\u202f10{superscript}"
    # Rounded first: 9.996 to three digits is 10.0, not 10.00.
    return f"{float(f'{mantissa}e{exponent}'):.{max(0, digits - 1 - power)}f}"


@functools.cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("studies.reporting"),
        autoescape=lambda name: str(name).endswith(".html"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=False,
    )
    environment.filters.update(inline=inline, paragraphs=paragraphs, number=number)
    return environment
