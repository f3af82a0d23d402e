"""How a node leaves ROS beside others that leave.

Fast DDS 2.14 waits for ever where a node's participant ends while a peer's end is just being
reported to it: it waits for that report with the lock in hand which the report needs. Nodes that
are asked to end together do that to each other, one of some hundred. So each takes back its topics
first, and ends itself a little later, at a time of its own. One that is held all the same is ended
by the system: its work is done, and rclpy waits with Python's own lock in hand, so that nothing of
Python's could end it.
"""

import ctypes
import faulthandler
import os
import time

from rclpy.node import Node

_AFTER_S, _APART_S, _TIMES = 0.1, 0.05, 8  # after the topics, and by how much processes differ
_SAID_S, _ENDED_S = 3.5, 4  # a process that is held says where, and ends

_CLOCK_MONOTONIC, _SIGEV_THREAD = 1, 2  # of <time.h> and <signal.h>


class _Event(ctypes.Structure):
    """struct sigevent of <signal.h>: `function` is called with `value`, in a thread of its own."""

    _fields_ = (
        ("value", ctypes.c_void_p),
        ("signal", ctypes.c_int),
        ("notify", ctypes.c_int),
        ("function", ctypes.c_void_p),
        ("more", ctypes.c_char * 40),
    )


def leave(node: Node, code: int = 1) -> None:
    """Destroy a node; a process that DDS holds all the same says where, and ends with `code`."""
    timer = ends_later(code)
    faulthandler.dump_traceback_later(_SAID_S)
    for subscription in [*node.subscriptions]:
        node.destroy_subscription(subscription)
    for publisher in [*node.publishers]:
        node.destroy_publisher(publisher)
    for service in [*node.services]:
        node.destroy_service(service)
    time.sleep(_AFTER_S + _APART_S * (os.getpid() % _TIMES))
    node.destroy_node()
    faulthandler.cancel_dump_traceback_later()
    ctypes.CDLL(None).timer_delete(timer)


def ends_later(code: int) -> ctypes.c_void_p:
    """The timer by which the system ends this process."""
    libc, timer = ctypes.CDLL(None), ctypes.c_void_p()
    exits = ctypes.cast(libc._exit, ctypes.c_void_p).value
    event = _Event(value=code, notify=_SIGEV_THREAD, function=exits)
    libc.timer_create(_CLOCK_MONOTONIC, ctypes.byref(event), ctypes.byref(timer))
    once = (ctypes.c_long * 4)(0, 0, _ENDED_S, 0)  # struct itimerspec
    libc.timer_settime(timer, 0, ctypes.byref(once), None)
    return timer
