"""The laws, by name.

Imports: jit, regions.
"""

from controller.law import CompiledLaw
from controller.laws.baselines.antonelli import AntonelliGains, AntonelliLaw
from controller.laws.baselines.pd import PdGains, PdLaw
from controller.laws.baselines.sun_cheah import SunCheahGains, SunCheahLaw
from controller.laws.baselines.unarbitrated import UnarbitratedGains, UnarbitratedLaw
from controller.laws.deployable import DeployableGains, DeployableLaw
from controller.laws.ismail_dunnigan import IsmailDunniganLaw

LAWS: dict[str, type[CompiledLaw]] = {
    law.name: law for law in (IsmailDunniganLaw, DeployableLaw, PdLaw, SunCheahLaw, UnarbitratedLaw, AntonelliLaw)
}

__all__ = [
    "LAWS",
    "AntonelliGains",
    "AntonelliLaw",
    "DeployableGains",
    "DeployableLaw",
    "IsmailDunniganLaw",
    "PdGains",
    "PdLaw",
    "SunCheahGains",
    "SunCheahLaw",
    "UnarbitratedGains",
    "UnarbitratedLaw",
]
