"""XML as every file of an FMU has it: declared, indented, the same text for the same tree."""

from __future__ import annotations

from xml.etree import ElementTree as ET


def xml_text(root: ET.Element) -> str:
    """Return a tree as the text of a file.

    Parameters
    ----------
    root : Element
        Indented in place.

    Returns
    -------
    str
        With declaration and a newline at its end.
    """
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
