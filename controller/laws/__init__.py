"""The laws, by name."""

from controller.law import CompiledLaw
from controller.laws.printed import PrintedLaw

LAWS: dict[str, type[CompiledLaw]] = {law.name: law for law in (PrintedLaw,)}

__all__ = ["LAWS", "PrintedLaw"]
