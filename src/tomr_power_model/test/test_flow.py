"""How much of a topic a node takes."""

import struct

import pytest

from tomr_power_model.topics.flow import Flow

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND


def message(stamp_ns: int, size: int = 100) -> bytes:
    return b"\x00\x01\x00\x00" + struct.pack("<iI", *divmod(stamp_ns, SECOND)) + bytes(size)


def taken(flow: Flow, rate: float, seconds: float, start: int = START) -> int:
    stamps = (start + round(n * SECOND / rate) for n in range(round(rate * seconds)))
    return sum(flow.refuses(message(stamp), 0) is None for stamp in stamps)


@pytest.mark.parametrize("rate", [10.0, 100.0, 1100.0])
def test_usual_rates_pass_whole(rate: float) -> None:
    assert taken(Flow(has_header=True), rate, 5.0) == rate * 5.0


def test_of_a_flood_the_rate_is_taken_evenly_and_what_follows_it_is_taken_whole() -> None:
    flow = Flow(has_header=True)
    assert taken(flow, 10_000.0, 5.0) == pytest.approx(1200 * 6, rel=0.01)  # with one burst
    last = START + 5 * SECOND
    assert taken(flow, 10_000.0, 0.1, last) == pytest.approx(120, abs=2)
    assert taken(flow, 1000.0, 2.0, last + SECOND // 5) == 2000


def test_a_clock_that_jumps_stops_nothing() -> None:
    flow = Flow(has_header=True)
    for jump in (0, -3600, 10**6, -5):
        assert taken(flow, 1000.0, 1.0, START + jump * SECOND) == 1000


def test_without_a_stamp_the_time_of_arrival_counts() -> None:
    for flow, data in ((Flow(has_header=False), message(START)), (Flow(True), message(0))):
        for n in range(3000):
            assert flow.refuses(data, START + n * SECOND // 1000) is None
        refusals = [flow.refuses(data, START) for _ in range(2000)]
        assert "more than 1200 messages a second" in str(refusals[-1])


def test_a_message_that_is_too_large_or_whose_stamp_cannot_be_read() -> None:
    flow = Flow(has_header=True)
    assert "2,000,012 bytes" in str(flow.refuses(message(START, 2_000_000), 0))
    assert flow.refuses(b"\x00\x01", START) is None
    big_endian = b"\x00\x00" + message(START)[2:]
    assert flow.stamp_of(big_endian) == 0
