"""Who flies the rows.

This process, processes of its own, or a Dask cluster; batches are sized by the time that a row takes, and a row that
kills its worker is refused.

Imports: plant_fmu.
"""
