r"""Takes the backslash from `\|` in code within tables, as Markdown on disk needs it and MkDocs does not.

A hook of MkDocs (`hooks` in mkdocs.yml).
"""

from __future__ import annotations

import re
from typing import Any

_CELL = re.compile(r"<td[^>]*>.*?</td>", re.S)
_CODE = re.compile(r"<code>.*?</code>", re.S)


def on_page_content(html: str, **_: Any) -> str:
    """Mend the code in all cells of a page."""
    return _CELL.sub(lambda cell: _CODE.sub(lambda code: code[0].replace("\\|", "|"), cell[0]), html)
