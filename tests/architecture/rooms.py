"""The subpackages of the four packages: their stated and their actual imports."""

import ast
import re
from collections import defaultdict

from tests.architecture.modules import FILES, PACKAGES, imported, tree_of

ROOMS = {module: path for module, path in FILES.items() if path.name == "__init__.py" and module not in PACKAGES}


def room_of(module: str) -> str:
    """The room in which a module stands; a package where it stands in none."""
    return module if FILES[module].name == "__init__.py" else module.rpartition(".")[0]


def imports_of(room: str) -> set[str]:
    """The rooms and packages that a room imports, inside functions too.

    Left out are what is common to its package, which stands at the package's root, the room around it, and the rooms
    within it. Rooms of its own package are named without it.
    """
    package, used = room.partition(".")[0], set()
    for module in (module for module in FILES if room_of(module) == room):
        for other in {room_of(name) for name in imported(module) if name in FILES} - {room}:
            if other.partition(".")[0] != package:
                used.add(other.partition(".")[0])
            elif not (f"{room}.".startswith(f"{other}.") or other.startswith(f"{room}.")):
                used.add(other.removeprefix(f"{package}."))
    return used


def stated_imports_of(room: str) -> set[str]:
    """Return the imports that a subpackage's docstring states in its line ``Imports:``."""
    line = re.search(r"^Imports: ([^.]*(?:\.\w[^.]*)*)\.$", ast.get_docstring(tree_of(ROOMS[room])) or "", re.M)
    assert line, f"{room}: its __init__.py has no line that states its imports"
    return set() if line[1] == "nothing" else set(re.split(r",\s+", line[1]))


def arrows(package: str) -> dict[str, set[str]]:
    """The outermost rooms of a package, and which of them each imports, with all that is in it."""
    used: dict[str, set[str]] = defaultdict(set)
    for room in (room for room in ROOMS if room.startswith(f"{package}.")):
        outer = room.split(".")[1]
        inside = {name.partition(".")[0] for name in imports_of(room)}
        used[outer] |= (inside & {r.split(".")[1] for r in ROOMS if r.startswith(f"{package}.")}) - {outer}
    return dict(used)
