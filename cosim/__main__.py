"""``python -m cosim``: the same as the ``cosim`` command."""

import sys

from plant_fmu.installing import install_hint

try:
    from cosim.command_line.cli import run_console

    status = run_console()
except ModuleNotFoundError as error:  # in a checkout that is not installed
    if (error.name or "").partition(".")[0] in ("cosim", "controller", "fuzzy_arbiter", "plant_fmu"):
        raise
    print(
        f"cosim: {error.name} is not installed: run {install_hint('./fuzzy_arbiter', '.')} in the checkout of subreach",
        file=sys.stderr,
    )
    status = 2
sys.exit(status)
