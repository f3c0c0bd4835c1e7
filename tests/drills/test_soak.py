"""A day of a live session with fifty viewers, shortened: thirty times real time, viewers come and go, and no memory is left behind."""

import contextlib
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import pytest

from command import RILLE
from effect_rigs import EARTH
from machines import cart, plane
from rille.live.client import Client
from rille.model import InputRefused, Scenario

VIEWERS, GUESTS = 50, 10  # of which so many leave, and others come, in each round
ROUNDS, WARM = 45, 10
ROUND = 0.3  # [s] a round at least
FACTOR = 30.0  # simulated time per real time: on its slope the circle drifts, and must not leave the plane
MOST_GROWTH = 1.8  # [MB] after that


def memory(process):
    """Resident memory [MB]."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    return int(next(line for line in status.splitlines() if line.startswith("VmRSS:")).split()[1]) / 1024


@pytest.fixture
def server(make_model):
    """``rille serve`` of a cart on a plane in a process of its own, and its address."""
    scenario = Scenario(name="s", duration=5, gravity=(0, 0, -EARTH), terrain="plane", placement="on_terrain", settle_time=2)
    path = make_model(cart(5.0, 0.15, 0.165), scenario, replace(plane(0.02), name="plane"))
    process = subprocess.Popen([RILLE, "serve", str(path), "--port", "0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.terminate()
        process.communicate(timeout=60)


def came(address, sender):
    """A client, as soon as the server answers."""
    patience = time.monotonic() + 60
    while True:
        try:
            return Client(address, sender)
        except InputRefused:
            if time.monotonic() > patience:
                raise
            time.sleep(0.2)


def test_fifty_viewers_for_hours_leave_no_memory_behind(server):
    """After a warm-up it grows by less than 1.8 MB, whatever it simulated, sent and was asked: 1.0 MB here, most of it the pictures that
    are kept for who comes late, which are bounded. Where cycles of closed connections stay, it is 13 MB.
    """
    process, address = server
    with contextlib.ExitStack() as stack:
        rover = stack.enter_context(came(address, "commander"))
        viewers = [stack.enter_context(Client(address, f"viewer-{k}")) for k in range(VIEWERS - GUESTS)]
        rover.take()
        rover.speed(FACTOR)
        rover.start()
        sizes, hours, frames = [], [], []
        for _ in range(ROUNDS):
            end = time.monotonic() + ROUND
            with contextlib.ExitStack() as guests:
                for k in range(GUESTS):
                    guests.enter_context(Client(address, f"guest-{k}"))
                rover.steer(0.05, 0.15)  # a circle: it stays on its plane however long it takes
                time.sleep(max(0.0, end - time.monotonic()))
            sizes.append(memory(process))
            hours.append(rover.time / 3600)
            frames.append([viewer.frames for viewer in viewers])
        assert process.poll() is None
        assert hours[-1] > hours[0], "time stands"
        assert all(last > first for first, last in zip(frames[0], frames[-1], strict=True)), "a viewer gets nothing any more"
        growth = sizes[-1] - sizes[WARM]
        said = f"{growth:+.2f} MB while {hours[-1] - hours[WARM]:.2f} h were simulated and {(ROUNDS - WARM) * GUESTS} guests came and went"
        print(said)
        assert growth < MOST_GROWTH, f"{said}: {sizes}"
