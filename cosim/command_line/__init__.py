"""The ``cosim`` command.

One verb a file. It alone prints.

Imports: campaigns, campaigns.falsification, campaigns.pages, campaigns.reruns, campaigns.scenes, campaigns.sweeps,
campaigns.workers, companion, controller, export, io, live, live.watching, logs, mavlink,
mavlink.conformance, mavlink.listening, mavlink.wire, plant_fmu, precheck, replay, results, run, scenario, sitl, ssp.
"""
