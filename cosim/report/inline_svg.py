"""Figures inside a page: their colors follow the reader's light or dark theme."""

from __future__ import annotations

import html
import re

_COLOR = re.compile(r"#[0-9a-fA-F]{6}\b")
_STYLE = re.compile(r'style="([^"]*)"')
DARK_GROUND, _DARK_INK = (0x16, 0x18, 0x1A), (0xE6, 0xE6, 0xE3)  # as in base.html.j2
_GRAY = 24  # difference of channels below which a color is a gray
_CONTRAST = 3.0  # least contrast of a line or mark to the ground

_Rgb = tuple[int, int, int]


def inline_svg(svg: str, alt: str) -> str:
    """Return an SVG file as an element of a page, with dark colors where the reader prefers a dark theme."""
    # Each color becomes a custom property whose fallback is the color itself: paper and light screens show the file.
    element = svg[svg.index("<svg") :]
    colors = sorted({c.lower() for style in _STYLE.findall(element) for c in _COLOR.findall(style)} | {"#000000"})
    dark = "".join(f"--c{color[1:]}:{dark_color(color)};" for color in colors)
    element = _STYLE.sub(lambda style: _COLOR.sub(_property, style[0]), element)
    # black is the fill of what names none, such as text
    opening = f'<svg role="img" aria-label="{html.escape(alt)}" style="fill:var(--c000000,#000)" '
    themed = f"<style>@media screen and (prefers-color-scheme:dark){{svg{{{dark}}}}}</style>"
    return element.replace("<svg ", opening, 1).replace("<defs>", f"{themed}<defs>", 1)


def dark_color(color: str) -> str:
    """Return the color for a dark ground: grays from white to black change places, hues are lightened."""
    r, g, b = (int(color[i : i + 2], 16) for i in (1, 3, 5))
    if max(r, g, b) - min(r, g, b) < _GRAY:
        return _mix(_DARK_INK, DARK_GROUND, (r + g + b) / 765.0)
    part, mixed = 0.0, color
    while contrast(mixed, _mix(DARK_GROUND, DARK_GROUND, 0.0)) < _CONTRAST:
        part += 0.05
        mixed = _mix((r, g, b), (255, 255, 255), part)
    return mixed


def contrast(one: str, other: str) -> float:
    """Return the contrast of two colors ``#rrggbb`` after WCAG 2, 1 to 21."""
    light, dark = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def _luminance(color: str) -> float:
    channels = (int(color[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    r, g, b = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def _mix(one: _Rgb, other: _Rgb, part: float) -> str:
    return "#" + "".join(f"{round(a + part * (b - a)):02x}" for a, b in zip(one, other, strict=True))


def _property(match: re.Match[str]) -> str:
    return f"var(--c{match[0][1:].lower()},{match[0]})"
