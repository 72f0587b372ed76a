"""``python -m cosim``: the same as the ``cosim`` command."""

import sys

from cosim.command_line.cli import main

sys.exit(main())
