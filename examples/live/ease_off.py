"""Hooks for the rover of `first_drive`: it goes slower while a wheel slips, and stops after 5 m."""

from rille.live import every, on_event, when

WHEELS = [f"wheel_{row}_{side}" for row in ("front", "middle", "rear") for side in ("left", "right")]
start = []


def slip(run):
    """Largest slip ratio of the six wheels [-]."""
    return max(run.read("wheel.slip_ratio", wheel)[0] for wheel in WHEELS)


@when(lambda run: slip(run) > 0.3, hold=1.0)
def ease_off(run):
    run.say(f"t = {run.time:.2f} s: slip {slip(run):.2f}, easing off")
    run.steer(0.08)


@when(lambda run: run.time > 1 and slip(run) < 0.22, hold=2.0)
def go_on(run):
    run.say(f"t = {run.time:.2f} s: slip {slip(run):.2f}, going on")
    run.steer(0.15)


@every(0.1)
def stop_after_five_metres(run):
    x, y, _ = run.read("part.position", "chassis")
    start.append((x, y))
    if (x - start[0][0]) ** 2 + (y - start[0][1]) ** 2 > 5.0**2:
        run.stop(f"5 m at t = {run.time:.1f} s")


@on_event()
def tell(run, event):
    run.say(f"t = {event.time:.2f} s: {event.message}")
