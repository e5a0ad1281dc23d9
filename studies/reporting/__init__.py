"""Reports as one self-contained HTML file, and figures in one style.

``Report("Pendulum", "One update.", [Verdict("It works.", tone="good")]).write(path)``
"""

from studies.reporting.sections import (
    Animation,
    Code,
    Figure,
    Gallery,
    KeyValues,
    Prose,
    Report,
    Section,
    Table,
    Verdict,
)

__all__ = [
    "Animation",
    "Code",
    "Figure",
    "Gallery",
    "KeyValues",
    "Prose",
    "Report",
    "Section",
    "Table",
    "Verdict",
]
