"""The suite's messages in the form that a recording takes."""

from functools import singledispatch
from typing import Any

import numpy as np

from tomr_power_model.messages.bag import bag_header, bag_message
from tomr_power_model.messages.outgoing import (
    TYPES,
    DiagnosticMessage,
    JointMessage,
    Outgoing,
    SupplyMessage,
)
from tomr_power_model.messages.readings import BATTERY_UNKNOWNS


@singledispatch
def to_bag(message: Outgoing) -> Any:
    """The rosbags message of a record."""
    raise TypeError(f"{type(message).__name__} is no message of this suite")


@to_bag.register
def _(message: SupplyMessage) -> Any:
    return bag_message(
        TYPES[SupplyMessage],
        header=bag_header(message.stamp_ns),
        voltage=message.reading.voltage,
        current=message.reading.current,
        present=True,
        **BATTERY_UNKNOWNS,
    )


@to_bag.register
def _(message: JointMessage) -> Any:
    return bag_message(
        TYPES[JointMessage],
        header=bag_header(message.stamp_ns),
        name=list(message.names),
        velocity=np.array(message.velocity),
        effort=np.array(message.effort),
    )


@to_bag.register
def _(message: DiagnosticMessage) -> Any:
    statuses = [
        bag_message(
            "diagnostic_msgs/msg/DiagnosticStatus",
            level=int(status.level),
            name=status.name,
            message=status.message,
            hardware_id=status.hardware_id,
            values=[
                bag_message("diagnostic_msgs/msg/KeyValue", key=key, value=value)
                for key, value in status.values
            ],
        )
        for status in message.statuses
    ]
    return bag_message(
        TYPES[DiagnosticMessage], header=bag_header(message.stamp_ns), status=statuses
    )
