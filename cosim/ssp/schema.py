"""Checks documents of SSP 1.0 by the schemas of the standard, which FMPy contains."""

from __future__ import annotations

import functools
import re
from importlib.resources import files

from lxml import etree  # which FMPy needs too

from cosim.errors import RunError

_ROOTS = ("SystemStructureDescription", "ParameterSet", "ParameterMapping")
_FILES = ("SystemStructureDescription", "SystemStructureParameterValues", "SystemStructureParameterMapping")
_NAMESPACE = re.compile(r"\{[^{}\s]*\}")
_OTHER_VERSION = re.compile(r"[2-9]")  # which these schemas are not of


def require_valid(where: str, content: bytes) -> None:
    """Raise `RunError` for the first thing that the schema of a document, or of a part of another kind, forbids."""
    root = etree.fromstring(content, etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True))
    for tag, file in zip(_ROOTS, _FILES, strict=True):
        for element in root.iter(f"{{http://ssp-standard.org/SSP1/{file}}}{tag}"):
            schema = _schema(file)
            if not (_OTHER_VERSION.match(element.get("version", "")) or schema.validate(element)):
                error = schema.error_log[0]
                raise RunError(f"{where}, line {error.line}: {_NAMESPACE.sub('', ' '.join(error.message.split()))}")


@functools.cache
def _schema(name: str) -> etree.XMLSchema:
    return etree.XMLSchema(file=str(files("fmpy.ssp") / "schema" / f"{name}.xsd"))
