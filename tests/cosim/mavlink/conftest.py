"""Stations, and link threads that stop with their test, even if it fails."""

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
    if importlib.util.find_spec("pymavlink"):
        from tests.cosim.mavlink.stubs import opened

        while opened:
            opened.pop().close()


@pytest.fixture
def station():
    """An autopilot as an ArduSub, whose station has seen one snapshot."""
    from tests.cosim.mavlink.station import Station

    station = Station("ardusub")
    station.look(0.0)
    station.wire.clear()
    return station
