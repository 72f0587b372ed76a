"""Lets links that are good on disk be good on the site: to files outside docs/, and by the names of pages.

A hook of MkDocs (`hooks` in mkdocs.yml). A file outside docs/ that a page links to, such as an example, becomes a page:
Markdown as it is, any other file with its text as code. A link whose words are a file's name, as in
`[theory.md](theory.md)`, has the title of that page in their place.
"""

from __future__ import annotations

import os
import posixpath
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

ALWAYS = ("CHANGELOG.md",)  # are in the navigation
FOLDER = "outside"

_LINK = re.compile(r"\[([^\[\]]*)\]\((?!\w+:|#)([^)#\s]+)(?=[#)])")
_TITLE = re.compile(r"^# (.*)$", re.M)
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
            text = f"# {path.relative_to(root).as_posix()}\n\n````{_LANGUAGES.get(path.suffix, 'text')}\n{text}\n````\n"
        # only those of ALWAYS may be in the navigation; the others are left out of it without a warning
        level = InclusionLevel.INCLUDED if path.name in ALWAYS else InclusionLevel.NOT_IN_NAV
        files.append(File.generated(config, _page(path, root), content=text, inclusion=level))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let links to files outside lead to their pages, and bear the titles of pages."""
    root, docs = _places(config)
    uri = page.file.src_uri
    here = docs / uri
    if uri.startswith(f"{FOLDER}/"):
        here = root / uri.removeprefix(f"{FOLDER}/")

    def led(match: re.Match[str]) -> str:
        words, target = match.groups()
        path = _resolved(target, here)
        inside = path.relative_to(docs).as_posix() if path.is_relative_to(docs) else _page(path, root)
        file = files.get_file_from_path(inside)
        if file is None:
            return match[0]
        title = _TITLE.search(file.content_string) if words == path.name and path.suffix == ".md" else None
        return f"[{title[1] if title else words}]({posixpath.relpath(file.src_uri, posixpath.dirname(uri))}"

    return _LINK.sub(led, markdown)


def _places(config: MkDocsConfig) -> tuple[Path, Path]:
    return Path(config.config_file_path).parent.resolve(), Path(config.docs_dir).resolve()


def _resolved(target: str, page: Path) -> Path:
    return Path(os.path.normpath(page.parent / target))


def _targets(text: str, page: Path) -> list[Path]:
    return [_resolved(target, page) for _, target in _LINK.findall(text)]


def _page(path: Path, root: Path) -> str:
    inside = Path(os.path.relpath(path, root)).as_posix()
    return f"{FOLDER}/{inside}" if path.suffix == ".md" else f"{FOLDER}/{inside}.md"
