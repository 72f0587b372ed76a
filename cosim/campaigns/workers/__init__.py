"""Worker pools, which fly the rows of a campaign.

In this process, in worker processes, or on a Dask cluster. Batches are sized by the time that a row takes. A row that
crashes its worker each time is refused.

Imports: plant_fmu.
"""
