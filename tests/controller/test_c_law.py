"""The law and the regions in C against the Python functions, alone and in lanes."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from controller import paper_law
from controller.paper_law import Gains
from controller.regions import (
    Box,
    Cone,
    Cylinder,
    DepthBand,
    Ellipsoid,
    HalfSpace,
    Orientation,
    Pipe,
    Prism,
    Region,
    Sphere,
    Visibility,
    pack,
)
from controller.regions.in_c import c_sources
from controller.regions.region_set import SHAPES as ALL
from fuzzy_arbiter import ramp

ROOT = Path(__file__).parents[2]
REAL = ROOT / "plant_fmu" / "csrc"
TURNED = (0.9, 0.1, -0.3, 0.2)

# every shape with the places where it has a corner, an edge, a face or a centre
SHAPES = {
    "sphere": (Sphere((1.0, -2.0, 3.0), 1.5), [(1.0, -2.0, 3.0), (2.5, -2.0, 3.0)]),
    "depth band": (DepthBand(4.0, 0.5), [(0.0, 0.0, 4.0), (0.0, 0.0, 4.5), (0.0, 0.0, 3.5)]),
    "half-space": (HalfSpace((1.0, 2.0, 3.0), (1.0, 1.0, -1.0)), [(1.0, 2.0, 3.0)]),
    "upright box": (
        Box((0.0, 0.0, 0.0), (2.0, 4.0, 6.0)),
        [(0.0, 0.0, 0.0), (1.0, 2.0, 3.0), (1.0, 0.0, 0.0), (2.0, 0.0, 3.0), (-1.0, 2.0, 0.5), (0.5, 0.0, 5.0)],
    ),
    "turned box": (Box((1.0, 2.0, 3.0), (2.0, 1.0, 3.0), TURNED), [(1.0, 2.0, 3.0)]),
    "cylinder": (
        Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 4.0), 1.0),
        [(0.0, 0.0, 2.0), (0.0, 0.0, 0.0), (1.0, 0.0, 4.0), (1.0, 0.0, 2.0), (2.0, 0.0, 5.0), (0.0, 0.0, 6.0)],
    ),
    "aslant cylinder": (Cylinder((-1.0, 2.0, 1.0), (2.0, 3.0, 5.0), 0.7), [(0.5, 2.5, 3.0), (-1.0, 2.0, 1.0)]),
    "ellipsoid": (
        Ellipsoid((1.0, 2.0, 3.0), (3.0, 2.0, 0.5), TURNED),
        [(1.0, 2.0, 3.0), (1.0 + 1e-9, 2.0, 3.0), (1.0, 2.0, 60.0)],
    ),
    "ellipsoid, thin along x": (Ellipsoid((1.0, 2.0, 3.0), (0.5, 3.0, 2.0), TURNED), [(1.0, 2.0, 3.0)]),
    "ellipsoid, thin along y": (Ellipsoid((1.0, 2.0, 3.0), (3.0, 0.5, 2.0), TURNED), [(1.0, 2.0, 3.0)]),
    "ball of an ellipsoid": (Ellipsoid((0.0, 0.0, 0.0), (2.0, 2.0, 2.0)), [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0)]),
    "prism": (
        Prism(((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (2.0, 1.0), (0.0, 3.0)), 1.0, 4.0),
        [
            (0.0, 0.0, 1.0),
            (2.0, 1.0, 2.0),
            (4.0, 1.5, 2.0),
            (2.0, 0.4, 2.5),
            (5.0, 4.0, 0.0),
            (2.0, 0.5, 5.0),
            *((2.0 + aside, 0.9, 2.0) for aside in (-0.05, -0.02, 0.02, 0.05)),  # under the corner that stands in
        ],
    ),
    "pipe": (
        Pipe(((0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (3.0, 4.0, 1.0)), 0.5),
        [(0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (1.5, 0.0, 0.0), (1.5, 0.5, 0.0), (-1.0, 0.0, 0.0)],
    ),
    "pipe aside": (Pipe(((1.0, -2.0, 0.5), (3.0, 1.0, -1.0), (2.0, 4.0, 1.0)), 0.5), [(3.0, 1.0, -1.0)]),
    "cone": (
        Cone((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.5, 4.0),
        [(0.0, 0.0, 0.0), (0.0, 0.0, 4.0), (0.0, 0.0, 2.0), (0.0, 0.0, -1.0), (0.0, 0.0, 6.0), (5.0, 0.0, 1.0)],
    ),
    "aslant cone": (Cone((1.0, 2.0, 3.0), (1.0, -1.0, 2.0), 1.2, 2.0), [(1.0, 2.0, 3.0)]),
    "orientation": (Orientation(TURNED, 0.3), [(0.0, 0.0, 0.0)]),
    "visibility": (
        Visibility((2.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.4, (0.5, 0.0, 0.0)),
        [(1.5, 0.0, 0.0), (0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (1.0, 1.0, 1.0)],
    ),
    "aslant visibility": (Visibility((2.0, -1.0, 0.5), (1.0, -2.0, 0.5), 0.4, (0.5, 0.2, -0.3)), [(2.0, -1.0, 0.5)]),
}

HARNESS = r"""
#include "law.h"
#include "regions.h"

enum { N = (int)(sizeof(Real) / sizeof(double)), MOST = 256, REGIONS = 32 };

static void gather(Real out[], const double in[], int n, int at) /* of rows of n numbers, those of N poses */
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < N; j++)
            set_lane(&out[i], j, in[(at + j) * n + i]);
}

static void scatter(double out[], const Real in[], int n, int at)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < N; j++)
            out[(at + j) * n + i] = lane(in[i], j);
}

void try_regions(int n, const int *kinds, const double *signs, const int *offsets, const double *numbers,
                 const double *shifts, int poses, const double *p, const double *e, double *g, double *dg, double *d)
{
    Real packed[MOST], moved[REGIONS][3], position[3], quaternion[4];
    Real value[REGIONS], gradient[REGIONS][3], clearance[REGIONS];
    for (int i = 0; i < offsets[n]; i++)
        packed[i] = splat(numbers[i]);
    for (int i = 0; i < 3 * n; i++)
        moved[i / 3][i % 3] = splat(shifts[i]);
    const Regions regions = {n, kinds, signs, offsets, packed, (const Real(*)[3])moved};
    for (int at = 0; at < poses; at += N) {
        gather(position, p, 3, at);
        gather(quaternion, e, 4, at);
        regions_evaluate(&regions, (const Real *)position, (const Real *)quaternion, value, gradient, clearance);
        scatter(g, value, n, at);
        scatter(dg, gradient[0], 3 * n, at);
        scatter(d, clearance, n, at);
    }
}

void try_ramp(int n, const double *clearance, const double *width, double *out)
{
    for (int at = 0; at < n; at += N) {
        Real c[1], w[1], r[1];
        gather(c, clearance, 1, at);
        gather(w, width, 1, at);
        r[0] = regions_ramp(c[0], w[0]);
        scatter(out, r, 1, at);
    }
}

void try_law(int poses, int n, const double *e, const double *v, const double *desired, const double *goal,
             const double *values, const double *gradients, const double *alphas, const double *gains, double period,
             double *estimate, double *wrench)
{
    for (int at = 0; at < poses; at += N) {
        Real q[4], nu[6], d[4], f[4], g[8], dg[8][3], a[8], k[8], phi[4], tau[6];
        gather(q, e, 4, at);
        gather(nu, v, 6, at);
        gather(d, desired, 4, at);
        gather(f, goal, 4, at);
        gather(g, values, n, at);
        gather(dg[0], gradients, 3 * n, at);
        gather(a, alphas, n, at);
        gather(k, gains, 8, at);
        gather(phi, estimate, 4, at);
        const Gains all = {k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7]};
        law_step(q, nu, d, f[0], f + 1, n, g, (const Real(*)[3])dg, a, &all, splat(period), phi, tau);
        scatter(estimate, phi, 4, at);
        scatter(wrench, tau, 6, at);
    }
}
"""


@pytest.fixture(scope="module", params=[1, 4], ids=["alone", "4 lanes"])
def library(request, tmp_path_factory):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("needs cc")
    folder = tmp_path_factory.mktemp("c_law")
    for file, code in ({"harness.c": HARNESS.encode()} | c_sources()).items():
        (folder / file).write_bytes(code)
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-Wno-psabi", "-ffp-contract=off", "-fPIC", "-shared"]
    if request.param > 1:
        flags.append(f"-DLANES={request.param}")
    else:
        flags.append("-Wpedantic")
    command = [compiler, *flags, f"-I{folder}", f"-I{REAL}", *map(str, folder.glob("*.c"))]
    out = folder / "law.so"
    subprocess.run([*command, "-o", str(out), "-lm"], check=True)
    return ctypes.CDLL(str(out))


def address(array):
    assert array.flags.c_contiguous
    return ctypes.c_void_p(array.ctypes.data)


def in_c(library, packed, positions, quaternions):
    m, n = len(positions), len(packed.kinds)
    values, gradients, clearances = np.empty((m, n)), np.empty((m, n, 3)), np.empty((m, n))
    kinds, offsets = packed.kinds.astype(np.int32), packed.offsets.astype(np.int32)
    library.try_regions(
        n, address(kinds), address(packed.signs), address(offsets), address(packed.numbers), address(packed.shifts),
        m, address(positions), address(quaternions), address(values), address(gradients), address(clearances),
    )  # fmt: skip
    return values, gradients, clearances


def in_python(packed, positions, quaternions):
    m, n = len(positions), len(packed.kinds)
    values, gradients, rotation_gradients, clearances = (
        np.empty((m, n)),
        np.empty((m, n, 3)),
        np.empty((n, 3)),
        np.empty((m, n)),
    )
    for i in range(m):
        packed.evaluate(positions[i], quaternions[i], values[i], gradients[i], rotation_gradients, clearances[i])
    return values, gradients, clearances


def unit_rows(rng, m):
    rows = rng.normal(size=(m, 4))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("keep", ["in", "out"])
def test_regions_are_those_of_python(library, name, keep):
    shape, special = SHAPES[name]
    packed = pack([Region("r", shape, keep, velocity=(0.1, -0.2, 0.3) if name != "orientation" else (0.0, 0.0, 0.0))])
    packed.move_to(2.0)
    rng = np.random.default_rng(1)
    # far and near, on a lattice where coordinates coincide, and at the special places of the shape as it stands now
    anywhere = np.concatenate([rng.normal(size=(1500, 3)) * 3.0 + 1.0, rng.uniform(-60.0, 60.0, (300, 3))])
    lattice = rng.integers(-4, 9, (600, 3)) / 2.0 + packed.shifts
    places = np.concatenate([anywhere, lattice, np.array(special) + packed.shifts])
    places = np.concatenate([places, np.full((-len(places) % 4, 3), 0.25)])
    attitudes = unit_rows(rng, len(places))
    attitudes[::7] = 1.0, 0.0, 0.0, 0.0
    attitudes[1::7] = np.array(TURNED) / np.linalg.norm(TURNED)
    attitudes[2::7] = -attitudes[1]
    for ours, theirs in zip(
        in_c(library, packed, places, attitudes), in_python(packed, places, attitudes), strict=True
    ):
        assert np.all(np.isfinite(theirs))
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)


def test_region_kind_without_c_code_is_nan(library):
    packed = pack([Region("r", Sphere((0.0, 0.0, 0.0), 1.0), "out")])
    unknown = packed._replace(kinds=np.array([max(kind.kind for kind in ALL.values()) + 1]))
    for numbers in in_c(library, unknown, np.ones((4, 3)), unit_rows(np.random.default_rng(5), 4)):
        assert np.isnan(numbers).all()


def test_regions_of_a_scene_are_evaluated_independently(library):
    """All shapes at once, each at a place of its own."""
    rng = np.random.default_rng(4)
    packed = pack([Region(name, shape, ("in", "out")[i % 2]) for i, (name, (shape, _)) in enumerate(SHAPES.items())])
    packed.shifts[:] = rng.normal(size=packed.shifts.shape)
    places, attitudes = rng.normal(size=(200, 3)) * 3.0 + 1.0, unit_rows(rng, 200)
    for ours, theirs in zip(
        in_c(library, packed, places, attitudes), in_python(packed, places, attitudes), strict=True
    ):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", SHAPES)
def test_missing_position_gives_nan_for_every_region(library, name):
    shape, _ = SHAPES[name]
    packed = pack([Region("r", shape, "out")])
    places, attitudes = np.full((4, 3), np.nan), np.full((4, 4), np.nan)
    value, _, clearance = in_c(library, packed, places, attitudes)
    assert np.all(np.isnan(value)) and np.all(np.isnan(clearance))


def test_ramp_is_that_of_python(library):
    rng = np.random.default_rng(2)
    clearance, width = rng.uniform(-1.0, 2.0, 400), rng.uniform(0.0, 1.5, 400)
    clearance[:5], width[:5] = (0.0, 1.0, 0.5, -1.0, np.nan), (1.0, 1.0, 0.0, 0.0, 0.3)
    out = np.empty(400)
    library.try_ramp(400, address(clearance), address(width), address(out))
    np.testing.assert_array_equal(out, [ramp(c, w) for c, w in zip(clearance, width, strict=True)])


def test_the_law_is_that_of_python(library):
    rng = np.random.default_rng(3)
    m, n = 2000, 3
    quaternions, desired = unit_rows(rng, m), unit_rows(rng, m)
    velocities, goal = rng.normal(size=(m, 6)), rng.normal(size=(m, 4)) * 5.0
    values, gradients = rng.normal(size=(m, n)), rng.normal(size=(m, n, 3))
    gradients[::5, 1] = 0.0
    values[::3, 2] = 0.0
    alphas, gains = rng.uniform(0.0, 1000.0, (m, n)), rng.uniform(0.5, 2.0, (m, 8)) * np.array(Gains())
    estimate, period = rng.normal(size=(m, 4)) * 10.0, 0.01
    expected_estimate, expected = estimate.copy(), np.empty((m, 6))
    for i in range(m):
        paper_law.step(
            quaternions[i], velocities[i], desired[i], goal[i, 0], goal[i, 1:], values[i], gradients[i], alphas[i],
            Gains(*gains[i].tolist()), period, expected_estimate[i], expected[i],
        )  # fmt: skip
    wrench = np.empty((m, 6))
    library.try_law(
        m, n, address(quaternions), address(velocities), address(desired), address(goal), address(values),
        address(gradients), address(alphas), address(gains), ctypes.c_double(period), address(estimate),
        address(wrench),
    )  # fmt: skip
    np.testing.assert_allclose(wrench, expected, rtol=1e-12, atol=1e-11)
    np.testing.assert_allclose(estimate, expected_estimate, rtol=1e-12, atol=1e-12)
