"""FMU states: saved, restored, serialized, and rejected where they do not fit."""

import numpy as np

from tests.plant_fmu.conftest import STATES, refused

# everything that moves or is drawn: lags, drifting current, noise of sensors that sample at odd rates
LIVELY = {
    "velocity.u": 0.4, "velocity.r": 0.3, "position.z": 2.0, "current.x": 0.2, "seed": 7, "current_variation.x": 0.2,
    "current_variation.z": 0.1, "current_correlation_time": 3.0, "current_variation_period": 0.13,
    "depth_sensor.rate": 9.0, "depth_sensor.noise": 0.05, "imu.rate": 70.0, "imu.acceleration_noise": 0.1,
    "dvl.rate": 7.0, "dvl.velocity_noise": 0.02, "dvl.delay": 0.3, "dvl.loss_probability": 0.3, "compass.rate": 11.0,
    "compass.noise": 0.01, "usbl.rate": 1.0, "usbl.noise": 0.5, "thrust_time_constant[1]": 0.2,
    "thrust_rate_limit[2]": 30.0, "wrench_time_constant": 0.4,
}  # fmt: skip


def outputs(slave):
    return [v.name for v in slave.description.modelVariables if v.causality in ("output", "local")]


def drive(slave, k0, k1):
    """Step with changing inputs; return all outputs after each step."""
    rows = []
    for k in range(k0, k1):
        slave.set_values(
            {"thrust[1]": 5.0 * np.sin(k), "thrust[2]": 20.0 * (-1) ** (k // 7), "wrench.X": 8.0, "wrench.N": 1.0}
        )
        slave.fmu.doStep(k * 0.02, 0.02)
        rows.append(slave.get(*outputs(slave)))
    return rows


def test_state_continues_bit_for_bit_here_and_in_another_instance(make_slave, fmi):
    """There as bytes: what a cluster or a file would carry."""
    slave, other = make_slave(fmi=fmi).start(**LIVELY), make_slave(fmi=fmi)
    drive(slave, 0, 50)
    state = slave.save()
    data = slave.serialize(state)
    assert data[:8] == bytes(8)  # some importers hand the block, not its address, to the function that frees it
    arrived = other.deserialize(data)
    other.restore(arrived)
    first = drive(slave, 50, 120)
    slave.restore(state)
    assert drive(slave, 50, 120) == drive(other, 50, 120) == first
    for _ in range(2):  # freeing a freed state succeeds
        slave.free(state)
    other.free(arrived)


def test_get_state_overwrites_an_existing_state(make_slave, fmi):
    slave = make_slave(fmi=fmi).start(**LIVELY)
    state = slave.save()
    drive(slave, 0, 5)
    (slave.fmu.fmi3GetFMUState if fmi == 3 else slave.fmu.fmi2GetFMUstate)(slave.fmu.component, state)
    here = slave.get(*STATES)
    drive(slave, 5, 9)
    slave.restore(state)
    assert slave.get(*STATES) == here
    slave.free(state)


def test_invalid_state_bytes_are_rejected(make_slave, fmi):
    slave, foreign = make_slave(fmi=fmi).start(), make_slave("bluerov2_heavy", fmi).start()
    state, strange = slave.save(), foreign.save()
    data = slave.serialize(state)
    refused(slave, lambda: slave.deserialize(data[:-8]), "bytes, expected")
    refused(slave, lambda: slave.deserialize(b""), "bytes, expected")
    refused(slave, lambda: slave.deserialize(bytes(len(data))), "of another FMU, or damaged")
    refused(slave, lambda: slave.deserialize(foreign.serialize(strange)), "of another FMU, or damaged")
    for at in map(int, np.linspace(40, len(data) - 1, 30)):
        flipped = data[:at] + bytes([data[at] ^ 0x55]) + data[at + 1 :]
        refused(slave, lambda: slave.deserialize(flipped), "checksum")  # noqa: B023
    slave.free(state)
    foreign.free(strange)


def fnv1a(data):
    value = 14695981039346656037
    for byte in data:
        value = (value ^ byte) * 1099511628211 % 2**64
    return value


def test_forged_state_with_invalid_values_is_rejected(make_slave, fmi):
    """With a checksum that fits, and a NaN in it."""
    slave = make_slave(fmi=fmi).start(**{"position.x": 123.456})
    state = slave.save()
    data = slave.serialize(state)
    of_start = 48  # behind head, interface, mode and flags
    assert data[of_start : of_start + 8] == bytes(8)
    for at, words in (
        (data.index(np.float64(123.456).tobytes()), "position.x is outside"),
        (of_start, "a time, mode or held value is out of range"),
    ):
        forged = data[:at] + np.float64(np.nan).tobytes() + data[at + 8 :]
        forged = forged[:24] + np.uint64(fnv1a(forged[32:])).tobytes() + forged[32:]
        refused(slave, lambda: slave.deserialize(forged), words)  # noqa: B023
    honest = data[:24] + np.uint64(fnv1a(data[32:])).tobytes() + data[32:]
    assert honest == data
    slave.free(state)


def test_state_of_the_other_interface_is_rejected(make_slave, fmi):
    slave, model = make_slave(fmi=fmi).start(), make_slave(fmi=fmi, interface="me").start()
    state = slave.save()
    arrived = model.deserialize(slave.serialize(state))
    refused(model, lambda: model.restore(arrived), "other interface")
    slave.free(state)
    model.free(arrived)
