"""Documentation in the FMUs of controller and arbiter: a page and licenses."""

from __future__ import annotations

from collections.abc import Sequence

from plant_fmu.contents.licenses import licenses
from plant_fmu.contents.page import render_page
from plant_fmu.variables import Variable


def contents(title: str, words: str, rows: Sequence[Variable], fmi: int) -> dict[str, bytes]:
    """Return the documentation files of an FMU by path; `words` are paragraphs with empty lines between them."""
    page = render_page("cosim.ssp/fmu_page.html.j2", rows, fmi, title=title, paragraphs=words.split("\n\n"))
    texts = {"documentation/index.html": page}
    texts |= {f"documentation/licenses/{name}": text for name, text in licenses(fmi).items()}
    return {name: text.encode() for name, text in texts.items()}
