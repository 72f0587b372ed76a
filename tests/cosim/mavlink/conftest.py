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


def station_of(profile):
    from tests.cosim.mavlink.station import Station

    station = Station(profile)
    station.look(0.0)
    station.wire.clear()
    return station


@pytest.fixture
def station():
    """An autopilot as an ArduSub, whose station has seen one snapshot."""
    return station_of("ardusub")


@pytest.fixture(params=["ardusub", "px4", "generic"])
def each_station(request):
    """An autopilot of each profile, whose station has seen one snapshot."""
    return station_of(request.param)
