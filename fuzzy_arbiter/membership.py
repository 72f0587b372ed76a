"""Map a measured clearance to a degree of membership."""


def ramp(clearance: float, width: float) -> float:
    """Return the degree to which a region matters, from the distance to its surface.

    The degree is 1 in the whole region and on its surface, so that the region has its full priority wherever it is
    violated, and falls linearly to 0 at `width` outside.

    Parameters
    ----------
    clearance : float
        Signed distance to the region's surface [m], positive outside.
    width : float
        Distance at which the degree reaches 0 [m]; 0 makes the membership crisp.

    Returns
    -------
    float
        Degree in [0, 1]; NaN for a clearance that is NaN.

    Examples
    --------
    >>> from fuzzy_arbiter.criteria import ramp
    >>> ramp(-0.1, 0.2), ramp(0.05, 0.2), ramp(0.3, 0.2)
    (1.0, 0.75, 0.0)
    """
    if clearance <= 0.0:
        return 1.0
    if clearance >= width:
        return 0.0
    return 1.0 - clearance / width if width > 0.0 else clearance  # NaN alone comes to the latter
