"""Attacks on what runs: parameters of nodes set over their own API, clients of the live view.

Both run in the child of the try as a command would: what is refused with a reason is 2, what
nobody expected is a traceback.
"""

import json
import math
import os
import random
import socket
import sys
import time
from collections.abc import Callable, Sequence
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

from attack.case import Attack, Base, attack
from tomr_power_model.cli import EXIT_BAD_INPUT, EXIT_OK, run_main
from tomr_sim_bridge.faults import all_parameters

NODES = ("tomr_diagnosis", "power_model", "power_residuals", "fault_classifier", "sim_bridge")
_ODD: tuple[object, ...] = (
    *(math.nan, math.inf, -math.inf, 1e308, -1.0, 0.0, 5e-324, 1.0, 0.5),
    *(0, 1, -1, 2**31, 2**62, True, False, "", "x", "\x00", "a\nb", "x" * 100_000),
    *([], [1.0], [math.nan] * 3, [1, 2, 3], ["a"], [True], [1.0] * 10_000),
)
_NAMES = (
    "",
    "x",
    "robot.mass",
    "physics.x.y",
    "use_sim_time",
    "a" * 5000,
    "faults.pushed.severity",
)
_REPLY_S = 2.0  # for an answer of the web server


@attack("parameters at run time")
def parameters(dice: random.Random, folder: Path, base: Base) -> Attack:
    node = dice.choice(NODES)
    choice = {"node": node, "seed": dice.randrange(2**31), "sets": dice.choice((1, 5, 40))}
    return Attack("parameters", (json.dumps(choice),), f"{choice['sets']} of {node}")


def set_parameters(arguments: Sequence[str]) -> int:
    """Make a node and set odd parameters: each is refused with a reason, or holds."""
    return run_main(_set_parameters, arguments)


def _set_parameters(arguments: Sequence[str] | None) -> int:
    import rclpy
    from rclpy.parameter import Parameter

    (text,) = arguments or ()
    choice = json.loads(text)
    dice = random.Random(choice["seed"])
    robot = files("tomr_power_model").joinpath("robots").joinpath("reference.yaml")
    with as_file(robot) as file:
        rclpy.init(args=["--ros-args", "--params-file", str(file), "--log-level", "fatal"])
    node = _node(choice["node"])
    names = sorted(str(name) for name in node._parameters)
    refused = 0
    for _ in range(choice["sets"]):
        count = dice.choice((1, 1, 3))
        wanted = []
        for _ in range(count):
            name = dice.choice(_NAMES) if dice.random() < 0.1 else dice.choice(names)
            wanted.append(Parameter(name, value=_odd(dice, name)))
        try:
            for result in node.set_parameters(wanted):
                refused += not result.successful
                if not result.successful and not result.reason:
                    raise RuntimeError(f"{wanted}: refused without a word")
        except rclpy.exceptions.ParameterNotDeclaredException:
            refused += 1
    os._exit(_said(refused))  # DDS takes its time to end


def _odd(dice: random.Random, name: str) -> Any:
    spec = all_parameters().get(name)
    if spec is not None and spec.kind == "float" and dice.random() < 0.3:
        return dice.uniform(max(spec.minimum, -1e6), min(spec.maximum, 1e6))
    return dice.choice(_ODD)


def _said(refused: int) -> int:
    if refused:
        print(f"error: {refused} refused", file=sys.stderr, flush=True)
    return EXIT_BAD_INPUT if refused else EXIT_OK


def _node(name: str) -> Any:
    if name == "sim_bridge":
        from tomr_sim_bridge.nodes.sim_bridge_node import SimBridge

        return SimBridge()
    if name == "power_model":
        from tomr_power_model.nodes.power_model_node import PowerModelNode

        return PowerModelNode()
    from tomr_fault_diag.nodes import diagnosis_node, fault_classifier_node, power_residuals_node

    made: dict[str, Callable[[], Any]] = {
        "tomr_diagnosis": diagnosis_node.DiagnosisNode,
        "power_residuals": power_residuals_node.PowerResidualsNode,
        "fault_classifier": fault_classifier_node.FaultClassifierNode,
    }
    return made[name]()


_LINES = (
    *("GET / HTTP/1.1", "GET /socket HTTP/1.1", "POST / HTTP/1.1", "GET /../etc/passwd HTTP/1.1"),
    *(
        "GET http://x/ HTTP/1.1",
        "GET //x@y:z[ HTTP/1.1",
        "GET /socket?\x00 HTTP/9.9",
        "\x16\x03\x01",
    ),
    *("GET /%2e%2e/%00 HTTP/1.1", "GET " + "/a" * 5000 + " HTTP/1.1", "", "PRI * HTTP/2.0"),
)
_HEADERS = (
    *("Host: x", "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13"),
    *("Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Origin: http://evil", "Origin: http://x"),
    *("Origin: http://[", "Content-Length: -1", "Content-Length: 99999999", "X: " + "y" * 9000),
    *(
        "Transfer-Encoding: chunked",
        "Sec-WebSocket-Key: x",
        ":",
        "\x00: \xff",
        "Expect: 100-continue",
    ),
)
_UPGRADE = (
    *("GET /socket HTTP/1.1", "Host: x", "Upgrade: websocket", "Connection: Upgrade"),
    *("Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="),
)
_ASKED = (
    *("", "{}", "[]", "null", "1", '"x"', "{", "[" * 900, '{"ask": "pictures"}', '{"ask": 1e999}'),
    *('{"ask": "pictures", "first": -1, "count": 1}', '{"ask": "fault", "id": null}'),
    *('{"ask": "pictures", "first": 0, "count": 1e9}', '{"ask": "fault", "id": {"a": [1]}}'),
    *('{"ask": "pictures", "first": 2147483647, "count": 2147483647}', "9" * 1000),
    *('{"ask": "pictures", "first": true, "count": 1}', '{"ask": "pictures", "first": NaN}'),
    *('{"ask": "fault", "id": "pushed", "settings": {"severity": 1e999}}', '{"ask": ["fault"]}'),
)


@attack("pages and sockets")
def clients(dice: random.Random, folder: Path, base: Base) -> Attack:
    sent = [_sent(dice) for _ in range(dice.choice((1, 3, 10)))]
    text = json.dumps([data.hex() for data in sent])
    return Attack("live view", (text,), repr(sent[0][:40]))


def _sent(dice: random.Random) -> bytes:
    """What one client sends: a request, frames after a handshake, or anything."""
    kind = dice.choice(("request", "request", "frames", "frames", "frames", "bytes"))
    if kind == "bytes":
        return dice.randbytes(dice.choice((1, 100, 20_000)))
    if kind == "request":
        lines = [dice.choice(_LINES), *dice.sample(_HEADERS, dice.randrange(6))]
        end = dice.choice(("\r\n\r\n", "\r\n\r\n", "\n\n", "\r\n", ""))
        return ("\r\n".join(lines) + end).encode("latin-1")
    data = ("\r\n".join(_UPGRADE) + "\r\n\r\n").encode()
    for _ in range(dice.choice((1, 3, 20))):
        data += _frame(dice)
    return data


def _frame(dice: random.Random) -> bytes:
    """A frame of a WebSocket, some of them malformed."""
    body = dice.choice(_ASKED).encode() if dice.random() < 0.8 else dice.randbytes(50)
    opcode = dice.choice((1, 1, 1, 2, 0, 8, 9, 10, 3, 15)) | dice.choice(
        (0x80, 0x80, 0x80, 0, 0xF0)
    )
    masked = dice.choice((0x80, 0x80, 0x80, 0))
    stated = (
        len(body) if dice.random() < 0.9 else dice.choice((0, 2**16, 2**31, 2**63 - 1, 2**64 - 1))
    )
    if stated < 126:
        head = bytes((opcode, masked | stated))
    elif stated < 2**16:
        head = bytes((opcode, masked | 126)) + stated.to_bytes(2, "big")
    else:
        head = bytes((opcode, masked | 127)) + stated.to_bytes(8, "big")
    mask = dice.randbytes(4) if masked else b""
    return head + mask + (bytes(b ^ mask[i % 4] for i, b in enumerate(body)) if masked else body)


def serve_clients(arguments: Sequence[str]) -> int:
    """Serve odd clients, and a good one after them."""
    return run_main(_serve_clients, arguments)


def _serve_clients(arguments: Sequence[str] | None) -> int:
    from tomr_view.server import Server

    (text,) = arguments or ()
    asked: list[Any] = []
    server = Server({"mode": "live", "faults": []}, [{"t": 0}], kept=3, command=asked.append)
    server.start("127.0.0.1", 0)
    host, _, port = server.address.removeprefix("http://").rstrip("/").partition(":")
    place = host, int(port)
    for data in json.loads(text):
        _send(place, bytes.fromhex(data))
        server.show({"t": 1})
    reply = _send(place, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", whole=True)
    server.close()
    if not reply.startswith(b"HTTP/1.1 200 ") or not reply.rstrip().endswith(b"</html>"):
        raise RuntimeError(f"no page after that: {reply[:80]!r}")
    for wish in asked:
        json.dumps(wish)
    return EXIT_OK


def _send(place: tuple[str, int], data: bytes, whole: bool = False) -> bytes:
    """Send, and read what comes: to the end, or the first of it."""
    found = b""
    deadline = time.monotonic() + _REPLY_S
    try:
        with socket.create_connection(place, timeout=_REPLY_S if whole else 0.05) as client:
            client.sendall(data)
            while (part := client.recv(65536)) and time.monotonic() < deadline:
                found += part
                if not whole:
                    break
    except OSError:  # closed or silent, as it may
        pass
    return found
