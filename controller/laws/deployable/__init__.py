"""The deployable law: keeps the paper's idea and works within real thrusters.

Imports: regions.
"""

from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.law import DeployableLaw

__all__ = ["LAW", "DeployableGains", "DeployableLaw"]

LAW = DeployableLaw
