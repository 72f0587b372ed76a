"""Stop the link threads of each test, even if the test fails."""

import importlib.util

import pytest


@pytest.fixture(autouse=True)
def links_end(monkeypatch):
    """Close what the test itself has started."""
    begun = []
    if importlib.util.find_spec("pymavlink"):
        from cosim.mavlink.thread import LinkThread

        start = LinkThread.start
        monkeypatch.setattr(LinkThread, "start", lambda links: begun.append(links) or start(links))
    yield
    for links in begun:
        links.close()
