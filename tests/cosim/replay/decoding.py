"""A page read by other means than those that wrote it: an HTML parser, JSON, and Python's own unpacking."""

from __future__ import annotations

import base64
import json
import math
import struct
import zlib
from html.parser import HTMLParser


class _Reader(HTMLParser):
    def __init__(self):
        super().__init__()
        self.elements, self.attributes, self.data, self.title = [], [], "", ""
        self._in = None

    def handle_starttag(self, tag, attrs):
        self.elements.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]
        self._in = "runs" if ("id", "runs") in attrs else tag

    def handle_endtag(self, tag):
        self._in = None

    def handle_data(self, data):
        if self._in == "runs":
            self.data += data
        elif self._in == "title":
            self.title += data


def read_page(text):
    """Return the parser with the page's elements, attributes and title, and its runs as {name: list of numbers}."""
    reader = _Reader()
    reader.feed(text)
    reader.close()

    def no_constant(name):
        raise AssertionError(f"{name} is no JSON")

    headers = json.loads(reader.data, parse_constant=no_constant)
    return reader, [(header, unpack(header)) for header in headers]


def unpack(header):
    packed = zlib.decompress(base64.b64decode(header["data"], validate=True), -15)
    names, rows = [signal["name"] for signal in header["signals"]], header["rows"]
    count = len(names) * rows
    assert len(packed) == 8 * count
    numbers = [struct.unpack("<d", packed[i::count])[0] for i in range(count)]
    return {name: numbers[i * rows : (i + 1) * rows] for i, name in enumerate(names)}


def active_of(header, columns, row):
    """Return which region is given way to, read off one row: 0 for the goal."""
    criteria = ["obstacle", "shape", "depth"]
    weights = [columns[f"weight.{name}"][row] for name in criteria]
    strongest = criteria[weights.index(max(weights))]  # of equal ones the first
    pressing = None
    for i, region in enumerate(header["regions"]):
        if region["criterion"] == strongest:
            clearance = columns[f"{region['name']}.clearance"][row]
            if pressing is None or clearance < pressing[0]:
                pressing = (clearance, i)
    if not pressing or not columns[f"membership.{strongest}"][row] > 0 or max(weights) < 0.005:
        return 0
    speed = math.hypot(*(columns[f"velocity.{axis}"][row] for axis in "uvw"))
    rests = columns["goal.clearance"][row] >= 0 and speed < 0.02 and max(weights) < 0.5 and pressing[0] >= 0
    return 0 if rests else pressing[1]
