"""Messages that the vehicle sends.

One table of messages with their builders, rates and groups, and the streams that send them unasked.

Imports: mavlink.vehicle, mavlink.wire, scenario, simulation.commands.
"""
