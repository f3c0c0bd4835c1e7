"""What can be asked of a live session: the messages of its remote API, checked by their types."""

import json
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

MOST = 2**53  # largest number of a request, as JavaScript has them
Name = Annotated[str, Field(min_length=1, max_length=200)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Request(BaseModel):
    """What every request carries.

    sender : who asks. sequence : the sender's number of it; each one higher than the last. time : simulated time [s] at which it is to
    act; none: as soon as it arrives.
    """

    model_config = ConfigDict(extra="forbid", strict=True)
    sender: Annotated[str, Field(min_length=1, max_length=64)]
    sequence: Annotated[int, Field(ge=0, le=MOST)]
    time: Annotated[float, Field(ge=0, allow_inf_nan=False)] | None = None


class Take(Request):
    """Take the command, while nobody has it; else its holder is told who asked."""

    kind: Literal["take"]


class Release(Request):
    """Give up the command."""

    kind: Literal["release"]


class HandOver(Request):
    """Hand the command over to another sender."""

    kind: Literal["hand_over"]
    to: Annotated[str, Field(min_length=1, max_length=64)]


class Start(Request):
    """Let time pass."""

    kind: Literal["start"]


class Pause(Request):
    """Hold time; the session can go on."""

    kind: Literal["pause"]


class Step(Request):
    """Take so many time steps, then pause."""

    kind: Literal["step"]
    count: Annotated[int, Field(ge=1, le=1_000_000)] = 1


class Reset(Request):
    """End this run and begin another at the start."""

    kind: Literal["reset"]


class Stop(Request):
    """End this run; it is complete and can be replayed."""

    kind: Literal["stop"]


class Speed(Request):
    """Simulated time per real time; what the machine cannot keep up with is not caught up."""

    kind: Literal["speed"]
    factor: Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)]


class Place(Request):
    """Begin elsewhere: x, y [m] and heading [rad] of the root in W, before the first step. No heading: as it is."""

    kind: Literal["place"]
    x: Finite
    y: Finite
    heading: Finite | None = None


class Drive(Request):
    """Set value of a drive, by its mode [rad/s, rad or N m; of a prismatic joint m/s, m or N]."""

    kind: Literal["drive"]
    drive: Name
    value: Finite


class Steer(Request):
    """Drive the rover: forward speed [m/s] and turn rate [rad/s, to the left]; wheels and steering follow from its geometry.

    lasts : [s] of real time after which the rover stands unless it is steered again: who hangs, does not drive on. None: for ever.
    """

    kind: Literal["steer"]
    forward: Finite
    turn: Finite = 0.0
    lasts: Annotated[float, Field(gt=0, le=3600)] | None = None


class Set(Request):
    """Put a joint or the root elsewhere: all numbers of the quantity [SI, in W]."""

    kind: Literal["set"]
    quantity: Name
    target: Name
    values: Annotated[list[Finite], Field(min_length=1, max_length=4)]


class Save(Request):
    """Keep the present state under a name, in the database."""

    kind: Literal["save"]
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _.-]{0,63}$")]


class Load(Request):
    """End this run and begin another that goes on from a saved state."""

    kind: Literal["load"]
    name: Name


AnyRequest = Annotated[
    Take | Release | HandOver | Start | Pause | Step | Reset | Stop | Speed | Place | Drive | Steer | Set | Save | Load,
    Field(discriminator="kind"),
]
_KINDS = {
    *("take", "release", "hand_over", "start", "pause", "step", "reset", "stop", "speed", "place"),
    *("drive", "steer", "set", "save", "load"),
}
_reader: TypeAdapter[Request] = TypeAdapter(AnyRequest)


class Answer(BaseModel):
    """What became of a request.

    sequence : that of the request; none where it had none that could be read. time : simulated time [s] at which it acts, or was refused.
    sentence : why it was refused.
    """

    kind: Literal["answer"] = "answer"
    sequence: int | None
    accepted: bool
    time: float
    sentence: str = ""


@dataclass(frozen=True, slots=True)
class Malformed:
    """What is no request: the sentence that says why, and its number, if that could be read."""

    sentence: str
    sequence: int | None


def read_request(text: str | bytes) -> Request | Malformed:
    """A request from JSON, or what is wrong with it."""
    try:
        return _reader.validate_json(text)
    except ValidationError as error:
        return Malformed(complaint(error.errors(include_url=False, include_context=False, include_input=False)), _number(text))


def _number(text: str | bytes) -> int | None:
    try:
        number = json.loads(text)["sequence"]
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    return number if isinstance(number, int) and not isinstance(number, bool) and 0 <= number <= MOST else None


def complaint(errors: list) -> str:
    """The first of pydantic's findings as a sentence."""
    first = errors[0]
    place = ".".join(str(part) for part in first["loc"] if part not in _KINDS and part != "body")
    said = first["msg"][0].lower() + first["msg"][1:]
    return f"the request is malformed{f' at {place!r}' if place else ''}: {said}; see /openapi.json"
