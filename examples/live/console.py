"""A control platform in twenty lines: drives the rover of `rille serve` through a turn, twenty times as fast as real time.

Usage: python console.py [ADDRESS]
"""

import sys
import time

from rille.live.client import Client

address = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8765"
with Client(address, sender="console") as rover:
    rover.take()
    rover.speed(20.0)
    rover.start()
    for second, forward, turn in ((0.1, 0.08, 0.0), (10, 0.08, 0.1), (25, 0.0, 0.2), (30, 0.08, 0.0), (40, 0.0, 0.0)):
        rover.steer(forward, turn, time=second)  # commands for later wait for their time
    while rover.time < 41:
        x, y, z = rover.read("part.position", "chassis")
        print(f"t = {rover.time:5.1f} s  x = {x:6.2f} m  y = {y:6.2f} m")
        time.sleep(0.2)
    rover.save("after the turn")
    rover.stop()
    print(f"run {rover.status['run_id']} of scenario '{rover.status['scenario']}' is in the database")
