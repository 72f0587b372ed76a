"""A peer as a process: ``python serve.py MODULE FUNCTION``, with its setup in JSON as the first line of the input.

Each further line is a number of items, or another argument, in JSON. Each answer is a line of JSON: ``seconds``, the
time of the call, or that which the function returned [s], with the dict that it returned, if any; or ``error``, the
reason why it failed.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import time


def main(module: str, function: str) -> None:
    """Serve until the input ends."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # the output of libraries does not mix with the answers

    def answer(**values: object) -> None:
        print(json.dumps(values), file=answers, flush=True)

    try:
        work = getattr(importlib.import_module(module), function)(json.loads(sys.stdin.readline()))
        answer(seconds=0.0)
        for line in sys.stdin:
            given = json.loads(line)
            before = time.perf_counter()
            done = work(given)
            taken = time.perf_counter() - before
            answer(
                **({"seconds": done if isinstance(done, float) else taken} | (done if isinstance(done, dict) else {}))
            )
    except Exception as error:  # noqa: BLE001 -- any failure of a peer is an answer
        answer(error=f"{type(error).__name__}: {error}")


if __name__ == "__main__":
    main(*sys.argv[1:3])
