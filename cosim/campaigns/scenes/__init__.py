"""Scored scenes.

Their file format, their generator, the flyer that scores one, and scenes as the rows of a campaign. Public: `Scene`,
`read_scenes`, `SceneFlyer`.

Imports: batch, campaigns.store, campaigns.workers, controller, plant_fmu, scenario, simulation.
"""
