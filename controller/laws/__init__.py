"""The laws, by name."""

from controller.law import CompiledLaw
from controller.laws.deployable import DeployableGains, DeployableLaw
from controller.laws.printed import PrintedLaw

LAWS: dict[str, type[CompiledLaw]] = {law.name: law for law in (PrintedLaw, DeployableLaw)}

__all__ = ["LAWS", "DeployableGains", "DeployableLaw", "PrintedLaw"]
