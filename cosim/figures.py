"""The figures of a run, in the order of its report: the paper's, and what stands behind them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import matplotlib as mpl
from matplotlib.figure import Figure

from cosim import figures_in_space as in_space
from cosim import figures_over_time as over_time
from cosim.drawing import STYLE, Drawing, Story


def drawings(story: Story) -> Iterator[Drawing]:
    """Yield every figure that the run has something to show for.

    Parameters
    ----------
    story : Story
        Scenario, record and summary.

    Yields
    ------
    Drawing
        In the order of the report.
    """
    figures: list[tuple[str, str, Callable[[Story], Figure]]] = [
        ("path-3d", "Path in space (after Fig. 5a). X marks the start, I the overlap of regions.", in_space.path_3d),
        (
            "path-plane",
            "Path from the side and above (after Fig. 5b); regions as silhouettes, dashed to be kept within.",
            in_space.path_plane,
        ),
        (
            "position-error",
            "RMS position error |p − p_d|/√3 (after Fig. 6; the quantity is assumed).",
            over_time.position_error,
        ),
        ("attitude", "Attitude (after Fig. 7).", over_time.attitude),
        (
            "weights-overlap",
            "Normalised weights around each overlap of regions (after Fig. 8; assumed).",
            over_time.weights_overlap,
        ),
        ("weights", "Memberships and weights over the whole run.", over_time.weights),
        ("clearance", "Clearance to each region, negative where it is violated.", over_time.clearance),
        ("helm", "Who steered, as it was ordered; grey where disarmed.", over_time.helm),
        ("forces", "Body force: what the law asks for, and what acts.", over_time.forces),
        ("thrusters", "Thruster forces.", over_time.thrusters),
        ("estimates", "Estimated restoring parameters against the truth (dotted).", over_time.estimates),
        (
            "lyapunov",
            "V of (31), which as printed leaves the frame where a region's gradient vanishes, and −W of (41): dV/dt "
            "where the law's wrench acts and the water rests. Red: where V is negative, or rises.",
            over_time.lyapunov,
        ),
    ]
    for name, caption, draw in figures:
        if name == "weights-overlap" and not story.summary["intersection_windows"]:
            continue
        if name == "path-plane" and story.scenario.moving:
            caption += (
                " What moved is faint where it began and ended; regions are full where they were when the vehicle had "
                "least clearance to them."
            )
        if name == "helm" and not story.scenario.commands.enabled:
            continue
        if name == "lyapunov" and not story.summary["lyapunov"]:
            continue
        if name == "thrusters":
            caption = over_time.thruster_caption(story.scenario)
        with mpl.rc_context(STYLE):
            yield Drawing(name, caption, draw(story))
