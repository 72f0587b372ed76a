"""Requests for log files are answered at once with an empty list."""

from pymavlink.dialects.v20 import all as mavlink

from tests.cosim.mavlink.station import Station


def test_log_list_is_empty_and_answered_immediately():
    """MAVSDK waits 7.5 s without an answer."""
    station = Station()
    (entry,) = station.send(mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    assert (entry.get_type(), entry.num_logs, entry.last_log_num, entry.size) == ("LOG_ENTRY", 0, 0, 0)


def test_missing_log_has_no_data():
    station = Station()
    data = station.send(mavlink.MAVLink_log_request_data_message(1, 1, 7, 90, 1000))[0]
    assert (data.get_type(), data.id, data.ofs, data.count) == ("LOG_DATA", 7, 90, 0)
    assert any("no log 7" in text for text in station.wire.texts)
    station.send(mavlink.MAVLink_log_erase_message(1, 1))
    station.wait(2.1)
    assert "Refused: there are no logs to erase" in station.wire.texts
