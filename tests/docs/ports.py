"""Replace the ports that the documents name by free ones, so that pages can run in parallel."""

import re
import socket
from dataclasses import replace

from tests.docs.directives import Directives
from tests.docs.pages import Block

_KNOWN = re.compile(r"\b(?:4560|5760|8765|9002|14540|14550|14551)\b")


class Ports:
    """The ports of one page: each that it names is another one, the same in all its blocks."""

    def __init__(self) -> None:
        self._free: dict[str, str] = {}

    def hidden(self, text: str) -> str:
        """Return a text of the page with free ports."""
        return _KNOWN.sub(lambda match: self._free.setdefault(match[0], _free_port()), text)

    def shown(self, text: str) -> str:
        """Return what was printed with the ports of the page."""
        for known, free in self._free.items():
            text = re.sub(rf"\b{free}\b", known, text)
        return text

    def block(self, block: Block) -> Block:
        """Return a block with free ports in its text and its directives."""
        said = {
            name: [tuple(map(self.hidden, item)) for item in value] if isinstance(value, list) else value
            for name, value in vars(block.directives).items()
        }
        return replace(block, text=self.hidden(block.text), directives=Directives(**said))


def _free_port() -> str:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as stream:
        stream.bind(("127.0.0.1", 0))
        return str(stream.getsockname()[1])
