"""Pictures of a vehicle: consistent with its file, without overlapping labels."""

from itertools import combinations

import numpy as np
import pytest
from PIL import Image

from plant_fmu import load_vehicle
from plant_fmu.__main__ import main
from plant_fmu.pictures import PICTURES, image
from plant_fmu.pictures.variable_map import FAMILIES, family_members, group_rows
from plant_fmu.thruster_lines import thruster_lines
from plant_fmu.variables import variables
from plant_fmu.vehicle import shipped_vehicles

VEHICLES = shipped_vehicles()


@pytest.mark.parametrize("name", VEHICLES)
def test_thruster_lines_reproduce_the_wrench_matrix(name):
    vehicle = load_vehicle(name)
    lines = thruster_lines(vehicle)
    assert len(lines) == vehicle.n_thrusters
    for line, column in zip(lines, vehicle.thruster_matrix.T, strict=True):
        assert line.force.tolist() == column[:3].tolist()
        # what the force does at that point; a propeller's own moment is along it
        along = line.force / np.linalg.norm(line.force)
        rest = column[3:] - np.cross(line.nearest, line.force)
        assert np.cross(rest, along) == pytest.approx(np.zeros(3), abs=1e-9)
        assert float(line.nearest @ line.force) == pytest.approx(0.0, abs=1e-9)  # the nearest one


def test_a_thruster_that_only_turns_the_body_has_no_line():
    import dataclasses

    vehicle = load_vehicle("odin")
    matrix = vehicle.thruster_matrix.copy()
    matrix[:3, 2] = 0.0
    turned = dataclasses.replace(vehicle, thruster_matrix=matrix)
    assert not thruster_lines(turned)[2].nearest.any()
    texts = [text.get_text() for text in PICTURES["thrusters"](turned).findobj() if hasattr(text, "get_text")]
    assert any("give only a moment are left out: 3" in text for text in texts)


def extents(figure):
    """Return the boxes of all texts but the numbers at the axes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    texts = [*figure.texts, *(text for legend in figure.legends for text in legend.get_texts())]
    for ax in figure.axes:
        texts += [*ax.texts, ax.title, ax.xaxis.label, ax.yaxis.label]
    texts = [text for text in texts if text.get_text().strip()]
    assert len(texts) > 10
    return {f"{text.get_text()} {i}": text.get_window_extent(canvas.get_renderer()) for i, text in enumerate(texts)}


@pytest.mark.slow
@pytest.mark.parametrize("picture", PICTURES)
@pytest.mark.parametrize("name", VEHICLES)
def test_labels_are_not_clipped_and_do_not_overlap(name, picture):
    figure = PICTURES[picture](load_vehicle(name))
    boxes = extents(figure)
    whole = figure.bbox
    for text, box in boxes.items():
        assert whole.x0 <= box.x0 and box.x1 <= whole.x1 and whole.y0 <= box.y0 and box.y1 <= whole.y1, text
    for (a, box), (b, other) in combinations(boxes.items(), 2):
        apart = box.x1 <= other.x0 or other.x1 <= box.x0 or box.y1 <= other.y0 or other.y1 <= box.y0
        assert apart, (a, b)


@pytest.mark.parametrize("name", VEHICLES)
def test_every_thruster_has_its_number_in_every_view(name):
    vehicle = load_vehicle(name)
    for ax in PICTURES["thrusters"](vehicle).axes:
        numbers = [int(part) for text in ax.texts if text.get_text() for part in text.get_text().split(",")]
        assert sorted(numbers) == list(range(1, vehicle.n_thrusters + 1))


@pytest.mark.parametrize("name", VEHICLES)
def test_every_variable_is_counted_once_in_the_map(name):
    table = variables(load_vehicle(name))
    for role in ("input", "state", "output"):
        of = [v for v in table if v.role == role]
        assert sum(row.count for row in group_rows(of)) == len(of)
    parameters = [v for v in table if v.role == "parameter"]
    found = [v.name for family in FAMILIES for v in family_members(parameters, family)]
    assert sorted(found) == sorted(v.name for v in parameters)


def test_variable_rows_show_indices_components_units_and_types():
    rows = {row.text: (row.count, row.units) for row in group_rows(variables(load_vehicle("odin")))}
    assert rows["thrust[1…8]"] == (8, "N")
    assert rows["thruster_matrix[1…6, 1…8]"] == (48, "–, N.m/N")
    assert rows["position.{x, y, z}"] == (3, "m")
    assert rows["actuator.thrust[1…8]"] == (8, "N, local")
    assert rows["seed"] == (1, "integer")


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_pictures_are_reproducible(suffix):
    vehicle = load_vehicle("odin")
    assert image(PICTURES["thrusters"](vehicle), suffix) == image(PICTURES["thrusters"](vehicle), suffix)


@pytest.mark.medium
@pytest.mark.parametrize("picture", PICTURES)
def test_the_command_writes_a_picture(picture, tmp_path, capsys):
    out = tmp_path / "out.png"
    assert main(["plot", "odin", picture, "--out", str(out)]) == 0
    assert capsys.readouterr().out == f"{out}\n"
    with Image.open(out) as drawn:
        assert drawn.width > 1000


def test_plot_command_rejects_unknown_formats_and_vehicles(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["plot", "odin", "thrusters", "--out", str(tmp_path / "out.gif")])
    assert "expected a name that ends in .png, .svg, .pdf" in capsys.readouterr().err
    assert main(["plot", "nautilus", "thrusters", "--out", str(tmp_path / "out.png")]) == 2
    assert not list(tmp_path.iterdir())
