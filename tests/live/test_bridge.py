"""Who commands, and in which order."""

from rille.live.bridge import ABSENT, MOST_SENDERS, Bridge


def test_one_commander_at_a_time_and_hand_over_is_explicit():
    bridge = Bridge(connected=lambda: {"a", "b"})
    assert "nobody commands" in bridge.not_yours("a")
    assert bridge.take("a") == ""
    assert "'a' commands" in bridge.take("b")
    assert bridge.asked_by == "b"
    assert bridge.not_yours("a") == ""
    assert "'a' commands, not 'b'" in bridge.hand_over("b", "b")
    assert bridge.hand_over("a", "b") == ""
    assert (bridge.commander, bridge.asked_by) == ("b", None)
    assert "'b' commands" in bridge.release("a")
    assert bridge.release("b") == ""
    assert bridge.commander is None


def test_the_command_is_never_lost(monkeypatch):
    """Not to a name that is nobody's, nor with one who came by REST and said nothing more."""
    now = [100.0]
    monkeypatch.setattr("rille.live.bridge.monotonic", lambda: now[0])
    bridge = Bridge(connected=lambda: {"a"})
    bridge.take("a")
    assert "'typo' is not here" in bridge.hand_over("a", "typo")
    assert bridge.commander == "a"
    assert "'a' commands" in bridge.take("b")
    bridge.release("a")
    assert bridge.out_of_order("rest", 1) == ""
    bridge.take("rest")
    assert "'rest' commands" in bridge.take("b")
    now[0] += ABSENT + 1
    assert bridge.take("b") == ""


def test_numbers_rise_for_each_sender():
    bridge = Bridge()
    assert bridge.out_of_order("a", 5) == ""
    assert bridge.out_of_order("b", 5) == ""
    assert "came before" in bridge.out_of_order("a", 5)
    assert "is late" in bridge.out_of_order("a", 4)
    assert bridge.out_of_order("a", 6) == ""


def test_memory_of_senders_is_bounded():
    bridge = Bridge()
    for number in range(3 * MOST_SENDERS):
        bridge.out_of_order(f"sender {number}", 1)
    assert len(bridge.last) == len(bridge.heard) == MOST_SENDERS
