"""The laws, by name."""

from controller.law import CompiledLaw
from controller.laws.antonelli import AntonelliGains, AntonelliLaw
from controller.laws.deployable import DeployableGains, DeployableLaw
from controller.laws.pd import PdGains, PdLaw
from controller.laws.printed import PrintedLaw
from controller.laws.sun_cheah import SunCheahGains, SunCheahLaw
from controller.laws.unarbitrated import UnarbitratedGains, UnarbitratedLaw

LAWS: dict[str, type[CompiledLaw]] = {
    law.name: law for law in (PrintedLaw, DeployableLaw, PdLaw, SunCheahLaw, UnarbitratedLaw, AntonelliLaw)
}

__all__ = [
    "LAWS",
    "AntonelliGains",
    "AntonelliLaw",
    "DeployableGains",
    "DeployableLaw",
    "PdGains",
    "PdLaw",
    "PrintedLaw",
    "SunCheahGains",
    "SunCheahLaw",
    "UnarbitratedGains",
    "UnarbitratedLaw",
]
