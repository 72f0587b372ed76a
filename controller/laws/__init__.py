"""The laws: one module each, which assigns its class to ``LAW``.

Each module in this folder is a law; its name is the law's name.

Imports: regions.
"""

from importlib import import_module
from pkgutil import iter_modules

from controller.law import CompiledLaw

__all__ = ["LAWS"]


def _find_laws() -> dict[str, type[CompiledLaw]]:
    """Return the class of each module in this folder, with its name set."""
    laws = {}
    for module in iter_modules(__path__):
        law = getattr(import_module(f"{__name__}.{module.name}"), "LAW", None)
        if not (isinstance(law, type) and issubclass(law, CompiledLaw)):
            raise TypeError(f"{__name__}.{module.name} has no LAW, expected its class, a CompiledLaw")
        law.name = module.name
        laws[module.name] = law
    return laws


LAWS: dict[str, type[CompiledLaw]] = _find_laws()
