"""Scored scenes.

File format, generators of families, the flyer that scores a scene, and scenes as the rows of a campaign. Public:
`Scene`, `read_scenes`, `SceneFlyer`.

Imports: batch, campaigns.store, campaigns.workers, controller, fuzzy_arbiter, plant_fmu, precheck, results,
scenario, simulation, step.
"""
