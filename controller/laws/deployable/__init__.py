"""The deployable law: keeps the paper's idea and works within real thrusters.

Imports: regions.
"""

from controller.laws.deployable.deployable_law import DeployableLaw
from controller.laws.deployable.gains import DeployableGains

__all__ = ["LAW", "DeployableGains", "DeployableLaw"]

LAW = DeployableLaw
