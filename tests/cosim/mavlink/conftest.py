"""Threads of links end with the test that starts them, also where it fails."""

import pytest

pytest.importorskip("pymavlink", reason="the mavlink extra is not installed")

from cosim.mavlink.thread import LinkThread


@pytest.fixture(autouse=True)
def links_end(monkeypatch):
    """Close what the test itself has started."""
    begun, start = [], LinkThread.start

    def started(links):
        begun.append(links)
        start(links)

    monkeypatch.setattr(LinkThread, "start", started)
    yield
    for links in begun:
        links.close()
