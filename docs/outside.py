"""Makes pages of files outside docs/ that pages link to, such as examples, so that their links lead somewhere.

A hook of MkDocs (`hooks` in mkdocs.yml). A Markdown file becomes a page as it is, any other one with its text as code;
links are written anew to lead there. On disk, and wherever the repository is looked at, they lead to the file itself.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

ALWAYS = ("CHANGELOG.md",)  # are in the navigation
FOLDER = "outside"

_LINK = re.compile(r"(?<=\]\()(?!\w+:|#)([^)#\s]+)(?=[#)])")
_LANGUAGES = {".py": "python", ".c": "c", ".h": "c", ".toml": "toml", ".html": "html", ".json": "json"}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for each file outside that a page links to."""
    root, docs = _places(config)
    waiting = [root / name for name in ALWAYS]
    for file in files.documentation_pages():
        waiting += _targets(file.content_string, docs / file.src_uri)
    made: set[Path] = set()
    while waiting:
        path = waiting.pop()
        if path in made or path.is_relative_to(docs) or not path.is_relative_to(root) or not path.is_file():
            continue
        made.add(path)
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".md":
            waiting += _targets(text, path)
        else:
            text = f"# {path.relative_to(root)}\n\n````{_LANGUAGES.get(path.suffix, 'text')}\n{text}\n````\n"
        # only those of ALWAYS may be in the navigation; the others are left out of it without a warning
        level = InclusionLevel.INCLUDED if path.name in ALWAYS else InclusionLevel.NOT_IN_NAV
        files.append(File.generated(config, _page(path, root), content=text, inclusion=level))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let links to files outside lead to their pages."""
    root, docs = _places(config)
    uri = page.file.src_uri
    here = docs / uri
    if uri.startswith(f"{FOLDER}/"):
        here = root / uri.removeprefix(f"{FOLDER}/").removesuffix(
            "" if (root / uri[len(FOLDER) + 1 :]).is_file() else ".md"
        )

    def led(match: re.Match[str]) -> str:
        path = _resolved(match[1], here)
        target = str(path.relative_to(docs)) if path.is_relative_to(docs) else _page(path, root)
        found = files.get_file_from_path(target)
        return os.path.relpath(target, os.path.dirname(uri)) if found else match[0]

    return _LINK.sub(led, markdown)


def _places(config: MkDocsConfig) -> tuple[Path, Path]:
    return Path(config.config_file_path).parent.resolve(), Path(config.docs_dir).resolve()


def _resolved(target: str, page: Path) -> Path:
    return Path(os.path.normpath(page.parent / target))


def _targets(text: str, page: Path) -> list[Path]:
    return [_resolved(target, page) for target in _LINK.findall(text)]


def _page(path: Path, root: Path) -> str:
    inside = os.path.relpath(path, root)
    return f"{FOLDER}/{inside}" if path.suffix == ".md" else f"{FOLDER}/{inside}.md"
