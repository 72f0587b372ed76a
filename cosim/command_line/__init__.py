"""The ``cosim`` command.

A file holds one verb, or a few that belong together. It alone prints.

Imports: campaigns, campaigns.falsification, campaigns.pages, campaigns.reruns, campaigns.scenes, campaigns.sweeps,
campaigns.workers, companion, controller, export, identification, identification.excitation, io, live, live.watching,
logs, mavlink, mavlink.conformance, mavlink.listening, mavlink.wire, plant_fmu, precheck, replay, results, run,
scenario, sitl, ssp.
"""
