"""Short names of settings: a parameter's id has sixteen characters."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import chain, count

MAX_LENGTH = 16  # characters

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
    "ACCELERATION": "ACCEL", "ATTITUDE": "ATT", "BANDWIDTH": "BW", "BARRIER": "BARR", "BRAKING": "BRAKE",
    "CONSTANT": "CONST", "CURRENT": "CURR", "DECELERATION": "DECEL", "FAILURE": "FAIL", "OBSTACLE": "OBST",
    "POSITION": "POS", "QUATERNION": "QUAT", "RESTORING": "REST", "SURFACE": "SURF", "THRESHOLD": "THRESH",
    "TOLERANCE": "TOL", "TURNING": "TURN", "VELOCITY": "VEL",
}  # fmt: skip
_AXES = {"0": "X", "1": "Y", "2": "Z"}


def parameter_names(keys: Iterable[str]) -> dict[str, str]:
    """Return a name for each key: ``law.gains.k_p1`` is LAW_K_P1, ``regions.SR1.shape.radius`` SR1_RADIUS."""
    # In names that are too long the longest words are shortened one by one: by a table, then by removing vowels, then
    # from their ends. A number at the end distinguishes equal names.
    all_keys = list(keys)
    names: dict[str, str] = {}
    for key in all_keys:
        words = _split_words(key, all_keys)
        candidates = (
            _shorten(words, MAX_LENGTH - len(tail)) + tail for tail in chain([""], map("_{}".format, count(2)))
        )
        names[key] = next(name for name in candidates if name not in names.values())
    return names


def _split_words(key: str, all_keys: list[str]) -> list[str]:
    text = re.sub(r"\.shape\.", ".", key) if key.startswith("regions.") else key
    for prefix, short in _PREFIXES:
        if text.startswith(prefix):
            text = short + text.removeprefix(prefix)
            break
    stem, _, last = key.rpartition(".")
    if last in _AXES and f"{stem}.2" in all_keys and f"{stem}.3" not in all_keys:  # component of a vector in space
        text = text.rpartition(".")[0] + "." + _AXES[last]
    return [word for word in re.split(r"[^A-Z0-9]+", text.upper()) if word] or ["P"]


def _shorten(words: list[str], max_length: int = MAX_LENGTH) -> str:
    parts = list(words)
    while len("_".join(parts)) > max_length:
        index = max(range(len(parts)), key=lambda i: (not parts[i].isdecimal(), len(parts[i])))
        word = parts[index]
        bare = _SHORT.get(word) or word[0] + re.sub("[AEIOU]", "", word[1:])
        if bare != word:
            parts[index] = bare
        elif len(word) > 1 and not word.isdecimal():
            parts[index] = word[:-1]
        else:  # too many words
            return "_".join(parts)[:max_length]
    return "_".join(parts)
