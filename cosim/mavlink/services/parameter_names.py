"""Short names of settings: a parameter's id has sixteen characters."""

from __future__ import annotations

import re
from collections.abc import Iterable

LONGEST = 16  # characters

_PREFIXES = (
    ("law.gains.", "LAW."),
    ("arbiter.", "ARB."),
    ("limit.", "LIM."),
    ("commands.", "CMD."),
    ("plant.parameters.thrust_", "THR."),
    ("plant.parameters.", "PLANT."),
    ("regions.", ""),
)
# abbreviations, used only in names that are too long, before vowels are removed
_SHORT = {
    "ACCELERATION": "ACCEL",
    "ATTITUDE": "ATT",
    "BANDWIDTH": "BW",
    "BARRIER": "BARR",
    "BRAKING": "BRAKE",
    "CONSTANT": "CONST",
    "CURRENT": "CURR",
    "DECELERATION": "DECEL",
    "FAILURE": "FAIL",
    "OBSTACLE": "OBST",
    "POSITION": "POS",
    "QUATERNION": "QUAT",
    "RESTORING": "REST",
    "SURFACE": "SURF",
    "THRESHOLD": "THRESH",
    "TOLERANCE": "TOL",
    "TURNING": "TURN",
    "VELOCITY": "VEL",
}
_AXES = {"0": "X", "1": "Y", "2": "Z"}


def parameter_names(keys: Iterable[str]) -> dict[str, str]:
    """Return a name for each key: ``law.gains.k_p1`` is LAW_K_P1, ``regions.SR1.shape.radius`` SR1_RADIUS.

    In names that are too long the longest words are shortened one by one: by a table, then by removing vowels, then
    from their ends. A number at the end distinguishes equal names.

    Parameters
    ----------
    keys : iterable of str
        Keys of settings.

    Returns
    -------
    dict of str to str
        Names by key. The same keys in the same order give the same names.
    """
    known = list(keys)
    names: dict[str, str] = {}
    taken: set[str] = set()
    for key in known:
        name = _fitted(_words(key, known))
        number = 2
        while name in taken:
            tail = f"_{number}"
            name = _fitted(_words(key, known), LONGEST - len(tail)) + tail
            number += 1
        taken.add(name)
        names[key] = name
    return names


def _words(key: str, known: list[str]) -> list[str]:
    text = re.sub(r"\.shape\.", ".", key) if key.startswith("regions.") else key
    for prefix, short in _PREFIXES:
        if text.startswith(prefix):
            text = short + text.removeprefix(prefix)
            break
    stem, _, last = key.rpartition(".")
    if last in _AXES and f"{stem}.2" in known and f"{stem}.3" not in known:  # component of a vector in space
        text = text.rpartition(".")[0] + "." + _AXES[last]
    return [word for word in re.split(r"[^A-Z0-9]+", text.upper()) if word] or ["P"]


def _fitted(words: list[str], longest: int = LONGEST) -> str:
    parts = list(words)
    while len("_".join(parts)) > longest:
        at = max(range(len(parts)), key=lambda i: (not parts[i].isdecimal(), len(parts[i])))
        word = parts[at]
        bare = _SHORT.get(word) or word[0] + re.sub("[AEIOU]", "", word[1:])
        if bare != word:
            parts[at] = bare
        elif len(word) > 1 and not word.isdecimal():
            parts[at] = word[:-1]
        else:  # too many words
            return "_".join(parts)[:longest]
    return "_".join(parts)
