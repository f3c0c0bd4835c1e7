"""Which of the model's names the words of a column mean: sets of words in any order and spelling; no name that contradicts is taken."""

import re
import unicodedata
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import product

SIDES = {
    "left": ("left", "l", "lh", "lhs", "links", "gauche", "izquierda", "izquierdo"),
    "right": ("right", "r", "rh", "rhs", "rechts", "droite", "droit", "derecha", "derecho"),
}
ENDS = {
    "front": ("front", "fore", "frt", "vorne", "vorn", "avant", "delantera", "delantero"),
    "middle": ("middle", "mid", "center", "centre", "central", "mitte", "milieu"),
    "rear": ("rear", "back", "aft", "hind", "hinten", "arriere", "trasera", "trasero"),
}
KINDS = {
    "wheel": ("wheel", "whl", "tyre", "tire", "roue", "rueda"),
    "steering": ("steering", "steer", "steerer", "lenkung"),
    "rocker": ("rocker",),
    "bogie": ("bogie", "bogey"),
    "knuckle": ("knuckle",),
    "chassis": ("chassis", "hull", "base"),
    "differential": ("differential", "diff"),
    "mast": ("mast",),
    "camera": ("camera", "cam"),
    "gripper": ("gripper",),
}
DRIVING = ("drive", "driving", "traction")  # of a wheel, unless the name says another kind of thing
SAYS_NOTHING = ("joint", "jnt", "link", "motor", "mot", "actuator", "servo", "encoder", "sensor", "state", "states")
LETTERS = {"f": "front", "m": "middle", "c": "middle", "r": "rear", "b": "rear"}  # of two, beside one for the side: "fl", "lf"
GROUPS = tuple(frozenset(group) for group in (SIDES, ENDS, KINDS))
SPELLINGS = {spelling: meaning for group in (SIDES, ENDS, KINDS) for meaning, spellings in group.items() for spelling in spellings}


def _pairs() -> dict[str, tuple[str, str]]:
    """An end and a side in one word, in either order: "fl", "lf", "frontleft". "lb" is a unit, and "lc", "rc" mean other things."""
    letters = [(end + side, LETTERS[end], SPELLINGS[side]) for end, side in product(LETTERS, "lr")]
    letters += [(side + end, LETTERS[end], SPELLINGS[side]) for end, side in product("fmr", "lr") if end + side != side + end]
    words = [(word, meaning) for meaning, spellings in ENDS.items() for word in spellings]
    sides = [(word, meaning) for meaning, spellings in SIDES.items() for word in spellings if len(word) > 2]
    long = [(one + other, end, side) for (a, end), (b, side) in product(words, sides) for one, other in ((a, b), (b, a))]
    return {word: (end, side) for word, end, side in [*letters, *long]}


PAIRS = _pairs()


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """What a name says. words : as written, in small letters. said : what tells things apart, in one spelling ("left", "wheel", "2")."""

    words: frozenset[str]
    said: frozenset[str]

    @property
    def numbers(self) -> frozenset[str]:
        """The numbers in the name."""
        return frozenset(word for word in self.said if word.isdecimal())

    @property
    def placed(self) -> bool:
        """Whether the name says a side, an end or a kind of thing of a machine."""
        return any(self.said & group for group in GROUPS)

    def contradicts(self, other: "Reading") -> bool:
        """Whether it says another side, end or kind of thing than the other, or only other numbers."""
        told = ((self.said & group, other.said & group) for group in GROUPS)
        return any(own and its and not own <= its for own, its in told) or bool(
            self.numbers and other.numbers and not self.numbers & other.numbers
        )


def words_of(name: str) -> list[str]:
    """Words of a name: parts between signs, humps and numbers, in small letters."""
    spaced = re.sub(r"([a-z])([A-Z])", r"\1 \2", name)
    return [word.lower() for word in re.findall(r"[^\W\d_]+|\d+", spaced)]


def read_name(name: str) -> Reading:
    """What a name says. Words that every name may have ("joint", "motor") count only where nothing but numbers is left without them."""
    words = words_of(name)
    said = [meaning for word in _joined(words) for meaning in _meanings(word)]
    kind = any(meaning in KINDS for meaning in said)
    said = ["wheel" if meaning in DRIVING and not kind else meaning for meaning in said]
    telling = [meaning for meaning in said if meaning not in (*SAYS_NOTHING, *DRIVING)]
    return Reading(words=frozenset(words), said=frozenset(said if all(word.isdecimal() for word in telling) else telling))


def number_alone(name: str) -> int | None:
    """The number of a name that says nothing else: 2 of "joint 2"; None of "wheel 2"."""
    telling = [word for word in words_of(name) if word not in SAYS_NOTHING]
    return int(telling[0]) if len(telling) == 1 and telling[0].isdecimal() else None


def meant(name: str, known: Iterable[str], wheels: Collection[str] = ()) -> tuple[str, ...]:
    """Which of the known names a name means.

    The one of the same words; else the fullest of those whose words it all says; else those that say all of its words, and more. None of
    them says another side, end or kind of thing.

    Parameters
    ----------
    wheels : known names that are wheels, whatever they say.

    Returns
    -------
    One name: a match. Several: they fit equally well, so that it is ambiguous. None: nothing fits.
    """
    own, readings = read_name(name), {one: read_name(one) for one in known}
    able = {one: reading for one, reading in readings.items() if not own.contradicts(_wheel(reading, one in wheels))}
    same = tuple(one for one, reading in able.items() if reading.words == own.words)
    if same or not own.said:
        return same
    within = {one: (len(reading.said), len(reading.words & own.words)) for one, reading in able.items() if reading.said <= own.said}
    if within:
        return tuple(one for one, told in within.items() if told == max(within.values()))
    return tuple(one for one, reading in able.items() if own.said <= reading.said)


def contradicting(name: str, known: str, wheel: bool = False) -> bool:
    """Whether a name cannot mean a known one. wheel : the known one is a wheel, whatever it says."""
    return read_name(name).contradicts(_wheel(read_name(known), wheel))


def nearest(name: str, known: Sequence[str]) -> list[str]:
    """Known names by how much of the name they say, those that say most first."""
    own = read_name(name)
    return sorted(known, key=lambda one: -len(read_name(one).said & own.said))


def _wheel(reading: Reading, wheel: bool) -> Reading:
    said = reading.said | {"wheel"} if wheel and not reading.said & KINDS.keys() else reading.said
    return Reading(words=reading.words, said=said)


def _joined(words: Sequence[str]) -> list[str]:
    """Words with single letters side by side joined, where the two say an end and a side: "f", "l" -> "fl"; "m" alone may be a motor."""
    made: list[str] = []
    for word in words:
        if made and len(word) == len(made[-1]) == 1 and made[-1] != "m" and word != "m" and made[-1] + word in PAIRS:
            word = made.pop() + word
        made.append(word)
    return made


def _meanings(word: str) -> tuple[str, ...]:
    """What a word says: an end and a side, or one thing; numbers without leading zeros, unknown words as they are but for accents."""
    if word.isdecimal():
        return (str(int(word)),)
    plain = "".join(sign for sign in unicodedata.normalize("NFKD", word) if not unicodedata.combining(sign))
    return PAIRS.get(plain) or (SPELLINGS.get(plain, plain),)
