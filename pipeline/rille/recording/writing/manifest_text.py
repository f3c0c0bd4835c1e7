"""The manifest that imports a file again."""

from collections.abc import Collection, Mapping
from types import MappingProxyType

import numpy as np

from rille.model.recording import Channel, Recording
from rille.model.sheet import toml_string
from rille.recording.writing.address import Address

HIDEABLE = ("noise", "delay", "resolution", "saturation", "stuck", "dropout", "gaps", "scenario")


def manifest_text(
    recording: Recording,
    file: str,
    kind: str,
    addresses: Mapping[str, Address],
    *,
    gaps: bool = False,
    accepted: Mapping[str, Collection[str]] = MappingProxyType({}),
    hidden: Collection[str] = (),
) -> str:
    """TOML of the manifest.

    Parameters
    ----------
    file : as the manifest shall name it. kind : of ``FORMATS``. addresses : where each channel stands.
    gaps : whether the clocks have gaps that are known. accepted : codes of the gate by channel, for what is known of it.
    hidden : of ``HIDEABLE``: what the manifest shall not tell.
    """
    lines = [f"name = {toml_string(recording.name)}", f"file = {toml_string(file)}", f'format = "{kind}"']
    if recording.scenario is not None and "scenario" not in hidden:
        lines.append(f"scenario = {toml_string(recording.scenario)}")
    messages = kind in ("mcap", "rosbag")
    lost = {channel.name for channel in recording.channels if np.isnan(channel.value).any()}
    if (gaps and "gaps" not in hidden) or (messages and lost and "dropout" not in hidden):
        lines.append('accepted = ["clock_gap"]')
    times = list(dict.fromkeys(address.time for address in addresses.values() if address.time))
    if times:
        lines += ["", "[time]", f"column = {toml_string(times[0])}", 'unit = "s"']
    seen: set[tuple] = set()
    for channel in recording.channels:
        address = addresses[channel.name]
        lines += ["", "[[channel]]", f"column = {toml_string(address.column)}"]
        if address.column != channel.name:
            lines.append(f"name = {toml_string(channel.name)}")
        if times and address.time != times[0]:
            lines.append(f"time = {toml_string(address.time)}")
        lines += _description(channel, address, hidden)
        what = (channel.quantity, channel.component, channel.target, channel.frame, channel.role)
        if what in seen:
            lines.append("redundant = true")
        seen.add(what)
        if channel.name in lost and not messages and "dropout" not in hidden:
            lines.append('missing = "accept"')
        if known := [code for code in accepted.get(channel.name, ()) if code not in hidden]:
            lines.append(f"accepted = [{', '.join(toml_string(code) for code in known)}]")
    return "\n".join(lines) + "\n"


def _description(channel: Channel, address: Address, hidden: Collection[str]) -> list[str]:
    lines = [f'quantity = "{channel.quantity}"']
    if channel.component:
        lines.append(f'component = "{channel.component}"')
    lines += [f"target = {toml_string(channel.target)}", f"unit = {toml_string(address.unit)}", f'role = "{channel.role}"']
    if channel.frame != "world":
        lines.append(f'frame = "{channel.frame}"')
    stated = {
        "noise": (channel.noise, channel.unit),
        "slow_noise": (channel.slow_noise, channel.unit),
        "delay": (channel.delay, "s"),
        "resolution": (channel.resolution, channel.unit),
    }
    for key, (value, unit) in stated.items():
        if value and key.removeprefix("slow_") not in hidden:
            lines.append(f'{key} = "{float(value)!r} {unit}"' if unit != "1" else f"{key} = {float(value)!r}")
    return lines
