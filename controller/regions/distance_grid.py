"""Signed distances at the nodes of a grid: the regions of meshes and of clouds of points."""

# Squared distance less |p|^2 is concave along every line, so that on each edge of a cell it is above its chord. With
# trilinear interpolation D of the distances at the nodes, spacing h, the true distance d satisfies
#     d^2 >= D^2 - 3/4 h^2,                                                                                        (1)
# inside, for the distance to what is outside, likewise. Beyond the grid, whose nearest point is c, the angle at c
# between p and any point of the body is at least a right one:
#     d(p)^2 >= |p - c|^2 + d(c)^2, so that (1) holds with D(p)^2 = |p - c|^2 + D(c)^2.                            (2)
# There the distance to the upright box about the body, which is convex and thus below D on the grid, is another bound.
# Hence D <= sqrt(s^2 + 3/4 h^2) holds wherever d <= s: the region of that level contains the body grown by s.

from __future__ import annotations

import hashlib
import logging
import math
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import platformdirs
from numpy.typing import NDArray

from controller.arithmetic import length3
from controller.compiling.library import is_trusted, write_atomic
from controller.errors import RegionError
from controller.regions.geometry import clamp
from controller.regions.numbers import LENGTH, SIZE, Number, vector
from controller.regions.shape import GREATEST, Array, Bounds, Evaluation, Vector3, require
from controller.regions.triangle_mesh import Mesh

MAX_NODES = 4_000_000
_DEFAULT_NODES = 80_000  # number of nodes without a stated spacing
_BORDER = 2  # number of cells around the grown body
_QUANTUM = 2.0**-10  # m, of which distances are whole multiples: pages and caches are a third as large
_VERSION = 1  # of what is cached
_FIRST = 12  # index of the first distance in the packed numbers

log = logging.getLogger(__name__)


class DistanceGrid(NamedTuple):
    """Distances from a body at the nodes of an upright grid, in a frame parallel to the world's."""

    low: Array  # (3,) m, position of the first node
    spacing: float  # m
    distances: Array  # (nx, ny, nz) m, from the body before it is grown, negative inside
    level: float  # m, interpolated distance at the region's surface
    border: float  # m, from the grid's ends to the body's upright box

    def error(self, offset: float) -> float:
        """Return by how much the region is larger than the body grown by an offset [m], or smaller for one below 0."""
        return abs(self.level - offset)

    def packed(self, position: tuple[float, ...]) -> tuple[float, ...]:
        """Return the numbers that `distance_grid` reads, for a grid whose frame is at a position [m, NED]."""
        return (
            *position, *self.low.tolist(), self.spacing, *map(float, self.distances.shape), self.level, self.border,
            *self.distances.ravel().tolist(),
        )  # fmt: skip

    def numbers(self) -> tuple[Number, ...]:
        """Return name and unit of each number of `packed`."""
        counts = (Number(f"count.{axis}", "", 2.0, float(MAX_NODES)) for axis in "xyz")
        distances = (Number(f"distance[{i}]", *LENGTH) for i in range(1, self.distances.size + 1))
        return (
            *vector("position", LENGTH), *vector("low", LENGTH), Number("spacing", *SIZE), *counts,
            Number("level", *LENGTH), Number("border", *LENGTH), *distances,
        )  # fmt: skip

    def bounds(self, position: tuple[float, ...]) -> Bounds:
        """Return the corners of the grid, which hold the region; position [m, NED]."""
        low = self.low + position
        high = low + self.spacing * (np.array(self.distances.shape) - 1)
        return tuple(low.tolist()), tuple(high.tolist())

    def surface(self, position: tuple[float, ...]) -> Mesh:
        """Return the region's surface as triangles: a corner in each cell that it crosses; position [m, NED]."""
        values = self.distances - self.level
        shifts = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
        cells = np.array(values.shape) - 1
        corners = np.stack([values[x : x + cells[0], y : y + cells[1], z : z + cells[2]] for x, y, z in shifts])
        crossed = (corners.min(axis=0) <= 0.0) & (corners.max(axis=0) > 0.0)
        places = np.argwhere(crossed)
        # the corner is the mean of the crossings of the cell's edges
        total, count = np.zeros((len(places), 3)), np.zeros(len(places))
        near = corners[:, crossed]
        for a, start in enumerate(shifts):
            for axis in range(3):
                if start[axis]:
                    continue
                b = a + (4, 2, 1)[axis]
                opposite = (near[a] <= 0.0) != (near[b] <= 0.0)
                step = np.zeros((len(places), 3)) + start
                step[opposite, axis] += near[a][opposite] / (near[a][opposite] - near[b][opposite])
                total[opposite] += step[opposite]
                count += opposite
        vertices = self.low + position + self.spacing * (places + total / count[:, None])
        index = np.full(tuple(cells), -1)
        index[crossed] = np.arange(len(places))
        return Mesh(vertices, _faces(values, index))


class OnGrid:
    """What shapes from files share: all is read from a grid, whose frame is at `position` [m, NED]."""

    position: Vector3  # m, NED

    @property
    def grid(self) -> DistanceGrid:
        """Distances about the body, whose file is read when they are first needed."""
        raise NotImplementedError

    def packed(self) -> tuple[float, ...]:
        """Return position, first node, spacing, number of nodes, level, border, and distances."""
        return self.grid.packed(self.position)

    def numbers(self) -> tuple[Number, ...]:
        """Return name and unit of each number of `packed`."""
        return self.grid.numbers()

    def bounds(self) -> Bounds:
        """Return the corners of the upright box about the grid."""
        return self.grid.bounds(self.position)


def _faces(values: Array, index: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return two triangles for each edge of the grid that the surface crosses, between the four cells about it."""
    parts = []
    for axis in range(3):
        one, other = (axis + 1) % 3, (axis + 2) % 3
        ends = np.moveaxis(values, axis, 0)
        inside = np.moveaxis(ends[:-1] <= 0.0, 0, axis)
        crossed = inside != np.moveaxis(ends[1:] <= 0.0, 0, axis)
        edges = np.argwhere(crossed)
        quads = []
        for a, b in ((-1, -1), (0, -1), (0, 0), (-1, 0)):
            cell = edges.copy()
            cell[:, one] += a
            cell[:, other] += b
            quads.append(index[tuple(cell.T)])
        quad = np.stack(quads, axis=1)
        outward = inside[crossed]
        quad[~outward] = quad[~outward][:, ::-1]
        parts += [quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]
    return np.vstack(parts)


def make_grid(
    shape: str, key: str, distances: Callable[[Array], Array], body: tuple[Array, Array], offset: float, spacing: float
) -> DistanceGrid:
    """Make the grid about a body's upright box [m]; `key` names what is cached, spacing 0 is a default."""
    # Units of arguments: offset, spacing [m]
    farthest = float(np.abs(body).max())
    require(
        farthest <= GREATEST, shape, "file", f"of positions up to {farthest:.3g} m", f"positions up to {GREATEST:g} m"
    )
    size = body[1] - body[0] + 2.0 * max(offset, 0.0)
    h = spacing or _default_spacing(size)
    border = max(offset, 0.0) + _BORDER * h
    low = body[0] - border
    counts = np.ceil(size / h).astype(int) + 2 * _BORDER + 1
    nodes = int(np.prod(counts.astype(float)))
    finest = (float(np.prod(size)) / MAX_NODES) ** (1.0 / 3.0)
    require(nodes <= MAX_NODES, shape, "spacing", h, f"above {finest:.2g} m, for at most {MAX_NODES:,} nodes")
    axes = [low[i] + h * np.arange(counts[i]) for i in range(3)]
    values = _cached(
        f"{key} {low.tolist()} {h!r} {counts.tolist()}",
        nodes,
        lambda: distances(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)),
    ).reshape(counts)
    # rounding moves a distance by half a quantum
    level = math.copysign(math.sqrt(offset**2 + 0.75 * h**2) + 0.5 * _QUANTUM, offset)
    grid = DistanceGrid(low, h, values, level, border)
    log.info("%s: %d nodes %.3g m apart, error up to %.2g m", shape, nodes, h, grid.error(offset))
    return grid


def _default_spacing(size: Array) -> float:
    """Return the spacing [m] at which a box of a size [m] has about the default number of nodes."""
    low, high = float(size.max()) / _DEFAULT_NODES, float(size.max())
    for _ in range(50):
        h = math.sqrt(low * high)
        few = np.prod(size / h + 2 * _BORDER + 2) <= _DEFAULT_NODES
        low, high = (low, h) if few else (h, high)
    return float(f"{high:.2g}") if float(f"{high:.2g}") >= high else float(f"{high * 1.05:.2g}")


def _cached(key: str, nodes: int, compute: Callable[[], Array]) -> Array:
    """Return rounded distances from the user's cache, or compute and keep them."""
    name = hashlib.sha256(f"{_VERSION} {key}".encode()).hexdigest()[:32]
    path = Path(platformdirs.user_cache_dir("subreach")) / "grids" / f"{name}.grid"
    try:
        if is_trusted(path.parent):
            kept = np.frombuffer(zlib.decompress(path.read_bytes()), np.int32)
            if kept.size == nodes:  # else it was cut
                return np.asarray(kept * _QUANTUM, dtype=float)
    except (OSError, ValueError, zlib.error) as error:
        log.debug("%s: %s", path, error)
    quanta = np.rint(compute() / _QUANTUM)
    if not np.isfinite(quanta).all():
        raise RegionError("distances are not finite, expected a body of finite size")
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        if is_trusted(path.parent):
            write_atomic(path, zlib.compress(quanta.astype(np.int32).tobytes()))
    except OSError as error:
        log.debug("%s: %s", path, error)
    return quanta * _QUANTUM


def distance_grid(p: Array, q: Array) -> Evaluation:
    """Evaluate a packed `DistanceGrid` at the position `p`."""
    x, y, z = p[0] - q[0] - q[3], p[1] - q[1] - q[4], p[2] - q[2] - q[5]
    if math.isnan(x) or math.isnan(y) or math.isnan(z):
        return math.nan, math.nan, math.nan, math.nan, math.nan
    h, ny, nz, m = q[6], int(q[8]), int(q[9]), q[11]
    x1, y1, z1 = (q[7] - 1.0) * h, (q[8] - 1.0) * h, (q[9] - 1.0) * h
    cx, cy, cz = clamp(x, 0.0, x1), clamp(y, 0.0, y1), clamp(z, 0.0, z1)
    i, j, k = min(int(cx / h), int(q[7]) - 2), min(int(cy / h), ny - 2), min(int(cz / h), nz - 2)
    u, v, w = cx / h - i, cy / h - j, cz / h - k
    a = _FIRST + (i * ny + j) * nz + k
    b, c, d = a + nz, a + ny * nz, a + ny * nz + nz
    # along z on the cell's four edges, then along y, then along x
    a0, b0, c0, d0 = q[a + 1] - q[a], q[b + 1] - q[b], q[c + 1] - q[c], q[d + 1] - q[d]
    a1, b1, c1, d1 = q[a] + w * a0, q[b] + w * b0, q[c] + w * c0, q[d] + w * d0
    near, far = a1 + v * (b1 - a1), c1 + v * (d1 - c1)
    distance = near + u * (far - near)
    gx = (far - near) / h
    gy = ((b1 - a1) + u * ((d1 - c1) - (b1 - a1))) / h
    gz = ((a0 + v * (b0 - a0)) + u * ((c0 + v * (d0 - c0)) - (a0 + v * (b0 - a0)))) / h
    ex, ey, ez = x - cx, y - cy, z - cz
    beyond = ex * ex + ey * ey + ez * ez
    if beyond > 0.0:
        inner = distance
        distance = math.sqrt(beyond + inner * inner)  # (2)
        gx = (ex if ex != 0.0 else inner * gx) / distance
        gy = (ey if ey != 0.0 else inner * gy) / distance
        gz = (ez if ez != 0.0 else inner * gz) / distance
        ex, ey, ez = x - clamp(x, m, x1 - m), y - clamp(y, m, y1 - m), z - clamp(z, m, z1 - m)
        to_box = length3(ex, ey, ez)
        if to_box > distance:
            distance, gx, gy, gz = to_box, ex / to_box, ey / to_box, ez / to_box
    g = distance - q[10]
    return g, gx, gy, gz, g
