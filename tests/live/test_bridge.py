"""Who commands, and in which order."""

from rille.live.bridge import MOST_SENDERS, Bridge


def test_one_commander_at_a_time_and_hand_over_is_explicit():
    bridge = Bridge()
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
    assert len(bridge.last) == MOST_SENDERS
