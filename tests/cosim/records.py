"""Records with other numbers, and runs under commands."""

import msgspec
import numpy as np

from cosim.results.run_result import load_run
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario


def filled(table, names, rows=slice(None), value=np.nan):
    """Return a table with one number in some rows of some columns."""
    for name in names:
        column, at = table[name].to_numpy().copy(), table.schema.get_field_index(name)
        column[rows] = value
        table = table.set_column(at, table.schema.field(at), [column])
    return table


def steered_run(folder, changes, commands):
    """Fly the harbour under commands, given as lists by step, and return the run."""
    log = folder / "log.jsonl"
    lines = [{"step": k, "command": command} for k, given in commands.items() for command in given]
    log.write_bytes(b"".join(msgspec.json.encode(line) + b"\n" for line in lines))
    scenario = load_scenario("harbour", ["commands.enabled=true", *changes])
    return load_run(run_scenario(scenario, folder / "run", report=False, commands_log=log).folder)
