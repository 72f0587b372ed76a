"""Documentation in the FMUs of controller and arbiter: a page and licences."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib import metadata, resources
from string import Template

from plant_fmu.contents.licenses import licenses
from plant_fmu.contents.page import tables
from plant_fmu.variables import Variable


def contents(title: str, words: str, rows: Sequence[Variable], fmi: int) -> dict[str, bytes]:
    """Make the documentation files of an FMU.

    Parameters
    ----------
    title : str
        Title of the page.
    words : str
        Description, in paragraphs separated by empty lines.
    rows : sequence of Variable
        Variables of the FMU.
    fmi : int
        FMI version, 2 or 3.

    Returns
    -------
    dict of str to bytes
        Files by path in the archive.

    Raises
    ------
    BuildError
        If the installation lacks its licence.
    """
    page = Template((resources.files("cosim.ssp") / "page.html").read_text(encoding="utf-8")).substitute(
        title=escape(title),
        words="\n".join(f"<p>{escape(paragraph)}</p>" for paragraph in words.split("\n\n")),
        fmi=f"{fmi}.0",
        version=escape(metadata.version("subreach")),
        variables=tables(rows),
    )
    texts = {"documentation/index.html": page}
    texts |= {f"documentation/licenses/{name}": licence for name, licence in licenses(fmi).items()}
    return {name: text.encode() for name, text in texts.items()}
