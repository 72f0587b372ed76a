"""The page on campaigns matches the code."""

import re
from pathlib import Path

from cosim.batch.fused import FusedFlyer
from cosim.batch.outcome import FIELDS
from cosim.batch.variation import Variation
from cosim.campaigns import vary_from
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.rows import SCHEMA
from cosim.campaigns.scenes.scene import Scene
from cosim.campaigns.scenes.scene_file import decode_scene
from cosim.campaigns.sweeps.design import KINDS
from cosim.command_line.cli import main
from cosim.scenario.scenario import load_scenario
from plant_fmu.toml_tables import fields_of, table_in

PAGE = (Path(__file__).parents[3] / "docs" / "campaigns.md").read_text()


def table_after(heading):
    """Return the rows of the first table after a heading, as lists of cells."""
    lines = PAGE[PAGE.index(heading) :].splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("|---"))
    rows = []
    for line in lines[first + 1 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def test_every_key_of_a_scene_is_documented():
    words = " ".join(row[0] for row in table_after("## Scenes"))
    for name, annotation in fields_of(Scene).items():
        table, _ = table_in(annotation)
        assert f"`{name}" in words
        for inner in fields_of(table) if table else ():
            assert f".{inner}`" in words, (name, inner)


def test_the_example_is_a_scene():
    scene = decode_scene(re.search(r"```json\n(.*?)```", PAGE, re.S).group(1).encode())
    assert scene.seed == 7 and scene.failed_thruster is None and scene.noise.position == 0.0


def test_every_column_is_documented_with_its_unit():
    rows = table_after("## How a flight goes")
    assert [row[0].strip("`") for row in rows] == SCHEMA.names
    units = [field.metadata[b"unit"].decode().replace(".", " ") for field in SCHEMA]
    assert [row[1] for row in rows] == units


def test_the_conditions_are_those_of_the_score():
    c = Conditions()
    text = " ".join(PAGE.split())
    assert f"{c.duration:g} s; every {c.control} s the law is called" in text
    assert c.plant_steps == 2 and f"two plant steps of {c.plant_step} s" in text
    assert f"for the last {c.settled:g} s" in text


def test_documented_commands_parse(tmp_path, capsys):
    commands = [
        line.split() for line in PAGE[: PAGE.index("A campaign flies")].splitlines() if line.startswith("cosim ")
    ]
    assert [words[1] for words in commands] == ["scenes", "campaign", "compare", "sweep", "rerun"]
    for _, *words in commands[1:]:
        words[1] = str(tmp_path / "none.jsonl")
        words[words.index("--out") + 1] = str(tmp_path / "out")
        assert main([word.replace("ismail_dunnigan,deployable", "ismail_dunnigan,none") for word in words]) == 2
        assert re.search("No such file|law 'none'|scenario .* is unknown|holds no campaign", capsys.readouterr().err)


def test_documented_sweep_keys_exist():
    words = next(line.split() for line in PAGE.splitlines() if line.startswith("cosim sweep"))
    keys = [vary.key for vary in vary_from(words[4 : words.index("--samples")])]
    assert len(keys) == 2
    FusedFlyer(Variation(load_scenario(words[2]), keys)).close()


def test_every_outcome_of_a_sweep_is_documented_with_its_unit():
    rows = table_after("A row has its number")
    assert [row[0].strip("`") for row in rows] == list(FIELDS)
    assert [row[1] for row in rows] == [unit.replace(".", " ") for _, unit, _ in FIELDS.values()]


def test_designs_and_ranges_are_documented():
    rows = table_after("| `--design` |")
    assert [row[0].strip("`") for row in rows] == list(KINDS)
    numbers = {"key": "k", "low": "1", "high": "2", "points": "3", "a": "1", "b": "2", "c": "3"}
    for texts, *_ in table_after("`--vary` names numeric keys"):
        for text in re.findall("`(.*?)`", texts):
            vary_from([re.sub(r"[a-z]+", lambda word: numbers.get(word.group(), word.group()), text)])


def test_the_snippet_runs(tmp_path, monkeypatch):
    from tests.cosim.campaigns.scene_data import PLAIN, write

    write(tmp_path / "scenes.jsonl", PLAIN[:1])
    monkeypatch.chdir(tmp_path)
    names = {}
    (scene,) = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    exec(scene, names)
    assert names["depths"].shape == (6000,) and names["score"].effort > 0.0
