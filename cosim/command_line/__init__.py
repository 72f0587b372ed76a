"""The ``cosim`` command.

Each module holds one verb, or a few related ones. No other package prints.

Imports: campaigns, campaigns.falsification, campaigns.pages, campaigns.scenes, campaigns.sweeps,
campaigns.workers, companion, controller, export, identification, io, live, live.watching,
logs, mavlink, mavlink.listening, mavlink.wire, plant_fmu, precheck, replay, report, results,
run, scenario, simulation.commands, sitl, ssp.
"""
