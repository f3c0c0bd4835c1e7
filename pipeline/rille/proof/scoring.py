"""What an answer is worth when the truth is known. Both are plain JSON values; nothing of the diagnosis is needed here."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from rille.model.ledger import Answer
from rille.proof.pulses import score_pulses

NAN = float("nan")
NAMING = ("named", "group", "parameter", "sensor_fault")  # verdicts that give a name
ABSTAINING = ("unknown", "cannot_know")
CONFIDENT = 0.8  # stated probability from which on a wrong name is a confident one
RIGHT_SORT: Mapping[str, tuple[str, ...]] = {
    "nothing": ("nothing_missing",),
    "parameter": ("parameter",),
    "sensor": ("sensor_fault",),
    "outside": ABSTAINING,
    "one": ("named", "group"),
    "two": ("named", "group"),
}
# The same thing under other words: (cause, kind) of the truth -> kinds that say it, too.
SYNONYMS: Mapping[tuple[str, str], tuple[str, ...]] = {
    ("parameter", "mass"): ("mass_change",),
    ("parameter", "viscous_friction"): ("viscous_friction.coefficient",),
    ("parameter", "frictional_modulus"): ("stiffness",),  # of both moduli; the cohesive one is small in these soils
    ("effect", "exit_angle"): ("exit_sinkage_ratio",),  # a change of lambda, as effect or as number
}
BASELINES = ("sindy", "gaussian_process", "tuning")
EVERYWHERE = ("world", "terrain", "soil", "machine")
LOG = "log_factor"  # number of an answer that is the logarithm of a factor

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """One trial.

    top : the best answer is the truth and nothing else (nothing concealed: said so; outside the catalogue: said to have no name).
    grouped : the truth is in the group of the best. pieces : share of the concealed things that are in the best answer or its group.
    abstained : no name was given. wrong : a name was given, and the truth is not in its group. confident_wrong : with a probability of at
    least 80 %. sort_right : the verdict says what sort of thing it is. target : the best answer's target is right. located : the place of
    the truth is among the three that differ most. overlap : of a push in time, intersection over union. error : of the amplitudes as one
    vector, relative; of a wrong number in proportion to the number. covered : share of the amplitudes within their 95 % intervals.
    gap : G. probability : stated, of the group of the best. seconds : of the diagnosis. NaN: does not apply.
    """

    trial: int
    sort: str
    machine: str
    strength: float
    truth: str
    status: str
    verdict: str = ""
    answer: str = ""
    top: bool = False
    grouped: bool = False
    pieces: float = NAN
    abstained: bool = False
    wrong: bool = False
    confident_wrong: bool = False
    sort_right: bool = False
    target: float = NAN
    located: float = NAN
    overlap: float = NAN
    error: float = NAN
    covered: float = NAN
    gap: float = NAN
    probability: float = NAN
    seconds: float = NAN

    def as_json(self) -> dict[str, Any]:
        """Plain JSON values; null for what does not apply."""
        return {name: None if isinstance(value, float) and not np.isfinite(value) else value for name, value in asdict(self).items()}


def title(truth: Json) -> str:
    """What is concealed, in words."""
    return (
        " + ".join(f"{piece['kind']} of {'all' if piece['target'] == '*' else piece['target']}" for piece in truth["pieces"]) or "nothing"
    )


def score(truth: Json, answer: Json | None, status: str = "done", seconds: float = NAN) -> Score:
    """The score of one answer. answer : the JSON of ``rille diagnose``; None: there is none, ``status`` says why, and that is a failure."""
    facts: dict[str, Any] = {
        "trial": truth["number"],
        "sort": truth["sort"],
        "machine": truth["machine"],
        "strength": truth["strength"],
        "truth": title(truth),
        "status": status,
        "seconds": seconds,
    }
    if answer is None:
        return Score(**facts)
    verdict, ranked, pieces = answer["verdict"], answer["ranked"], truth["pieces"]
    names = verdict in NAMING
    best = ranked[0] if ranked else None
    group = [entry for entry in ranked if best is not None and entry["group"] == best["group"]]
    inside = truth["sort"] not in ("nothing", "outside")
    top = names and inside and best is not None and is_truth(best, pieces)
    grouped = names and inside and any(is_truth(entry, pieces) for entry in group)
    said = [term for entry in group for term in entry["terms"]] if names else []
    found = [piece for piece in pieces if inside and any(same(term, piece) for term in said)]
    if not inside:
        top = grouped = verdict in RIGHT_SORT[truth["sort"]]
    wrong = names and not grouped and not (truth["sort"] == "two" and len(found) == len(pieces))
    probability = _probability(answer, best) if names and best is not None else NAN
    own = best["terms"] if best is not None and names else []
    named = [(piece, term) for piece in found for term in own if same(term, piece)]
    mass_is_right = truth["sort"] == "parameter" and grouped  # a wrong mass is what the catalogue calls a change of mass
    return Score(
        **facts,
        verdict=verdict,
        answer=best["title"] if names and best is not None else "",
        top=top,
        grouped=grouped,
        pieces=len(found) / len(pieces) if inside and pieces else NAN,
        abstained=not names,
        wrong=wrong,
        confident_wrong=wrong and probability >= CONFIDENT,
        sort_right=verdict in RIGHT_SORT[truth["sort"]] or mass_is_right,
        target=_share(any(_same_target(term, piece) for term in own) for piece in pieces) if names and inside else NAN,
        located=_share(_located(answer, piece) for piece in pieces) if verdict != "nothing_missing" else NAN,
        overlap=_mean([_overlap(piece, term) for piece, term in named]),
        error=_mean([relative_error(term, piece) for piece, term in named]),
        covered=_mean([_covered(term, piece) for piece, term in named]),
        gap=_number((answer.get("proof") or {}).get("gap_closed")),
        probability=probability,
    )


def score_answer(truth: Json, answer: Answer) -> dict[str, Any]:
    """Scores of all that was said of a trial, as plain JSON values: of the diagnosis, and of each baseline by its name."""
    said = json.loads(answer.text) if answer.status == "done" else {}
    if truth["sort"] == "real":
        return {"real": score_real(truth, said.get("diagnosis"), answer.status, answer.seconds)}
    scores = {"diagnosis": score(truth, said.get("diagnosis"), answer.status, answer.seconds).as_json()}
    return scores | {name: score(truth, _as_answer(one)).as_json() for name, one in said.items() if name in BASELINES}


def score_real(truth: Json, answer: Json | None, status: str, seconds: float) -> dict[str, Any]:
    """The score of one trial of real recordings: how many of the concealed things were found (``right`` of ``of``) among how many that
    were named (``said``), what was answered, and G where something was held out.
    """
    facts = {"trial": truth["number"], "title": truth["title"], "status": status, "seconds": seconds}
    concealed = len(truth.get("pulses", ()) or truth["pieces"])
    if answer is None:
        return facts | {"verdict": "", "answer": "", "right": 0, "of": concealed, "said": 0, "gap": None}
    ranked = answer["ranked"]
    best = ranked[0] if ranked and answer["verdict"] in NAMING else None
    facts |= {"verdict": answer["verdict"], "gap": (answer.get("proof") or {}).get("gap_closed")}
    if "pulses" in truth:
        return facts | {"answer": ""} | score_pulses(truth, answer["transients"])
    terms = [term for entry in ranked if best is not None and entry["group"] == best["group"] for term in entry["terms"]]
    right = sum(any(same(term, piece) for term in terms) for piece in truth["pieces"])
    said = len(best["terms"]) if best is not None else 0
    return facts | {"answer": best["title"] if best is not None else "", "right": right, "of": concealed, "said": said}


def _as_answer(said: Json) -> Json:
    """What a baseline said, in the words of a diagnosis."""
    name = said["name"]
    causes = {"effect": "named", "parameter": "parameter", "sensor": "sensor_fault"}
    verdict = causes[name["cause"]] if name is not None else "unknown" if said["differs"] else "nothing_missing"
    ranked = []
    if name is not None:
        hypothesis = {**name, "target_kind": "", "free": [], "fixed": {}}
        term = {"term": {"hypothesis": hypothesis, "values": []}, "estimates": []}
        ranked = [{"terms": [term], "title": f"{name['kind']} of {name['target']}", "group": 0, "probability": None}]
    proof = {"gap_closed": said["gap_closed"]}
    return {"verdict": verdict, "ranked": ranked, "groups": [], "location": {"targets": []}, "proof": proof}


def same(term: Json, piece: Json) -> bool:
    """Whether a named term says what a concealed piece is."""
    hypothesis = term["term"]["hypothesis"]
    kinds = (piece["kind"], *SYNONYMS.get((piece["cause"], piece["kind"]), ()))
    if hypothesis["kind"] != piece["kind"] and hypothesis["target_kind"] == "soil":  # every wheel stands on it
        return hypothesis["kind"] in kinds
    return hypothesis["kind"] in kinds and _same_target(term, piece)


def is_truth(entry: Json, pieces: Sequence[Json]) -> bool:
    """Whether an entry is what is concealed and nothing else."""
    terms = entry["terms"]
    return len(terms) == len(pieces) and all(any(same(term, piece) for term in terms) for piece in pieces)


def _same_target(term: Json, piece: Json) -> bool:
    hypothesis = term["term"]["hypothesis"]
    target, sort = hypothesis["target"], hypothesis["target_kind"]
    if piece["cause"] == "sensor":
        whole = piece["kind"] == "clock_skew" and piece["target"].startswith(target.rpartition(" of ")[2])  # all that the clock stamps
        return hypothesis["cause"] == "sensor" and (target == piece["target"] or sort == "clock" or whole)
    if piece["target"] == "*":
        return target in ("*", "") or sort in EVERYWHERE
    if target == "*":  # all of one
        return sort == "wheel" and piece["target"] == "wheel"
    return target == piece["target"]


def _located(answer: Json, piece: Json) -> bool:
    targets = sorted(answer["location"]["targets"], key=lambda one: -_number(one["share"]))
    found = [one["name"] for one in targets if one["differs"]][:3]
    if piece["cause"] == "sensor":
        return any(piece["target"].startswith(name) for name in found)
    return bool(set(piece["near"]) & set(found)) if piece["near"] else bool(found)


def _probability(answer: Json, best: Json) -> float:
    group = next((g for g in answer["groups"] if g["number"] == best["group"]), None)
    return _number(group["probability"] if group is not None else best["probability"])


def _numbers(term: Json) -> dict[str, float]:
    """All numbers of a term by name."""
    hypothesis = term["term"]["hypothesis"]
    free = zip(hypothesis["free"], term["term"]["values"], strict=True)
    return {name: _number(value) for name, value in hypothesis["fixed"].items()} | {n["name"]: _number(v) for n, v in free}


def relative_error(term: Json, piece: Json) -> float:
    """|estimate - truth| / |truth| of the amplitudes as one vector; of a wrong number of the model in proportion to the number itself."""
    if piece["cause"] == "parameter":
        wanted = float(piece["numbers"][piece["kind"]])
        return abs(_change(term, piece) - wanted) / abs(1.0 + wanted)
    numbers = _numbers(term)
    names = [name for name in piece["amplitudes"] if name in numbers]
    given = np.array([piece["numbers"][name] for name in names])
    off = np.array([numbers[name] for name in names]) - given
    return float(np.linalg.norm(off) / np.linalg.norm(given)) if names and np.any(given) else NAN


def _change(term: Json, piece: Json, value: float | None = None) -> float:
    """Relative change of a number of the model that a term says; value : of its free number, instead of the estimate."""
    hypothesis = term["term"]["hypothesis"]
    if not hypothesis["free"]:  # a baseline's
        return NAN
    free = hypothesis["free"][0]
    said = _numbers(term)[free["name"]] if value is None else value
    if hypothesis["kind"] == "mass_change":
        return said / piece["reference"]
    change = float(np.expm1(said)) if free["name"] == LOG else said / free["absent"] - 1.0
    if piece["kind"] == "friction_angle":
        angle = piece["reference"]
        return float(np.tan(angle * (1 + change)) / np.tan(angle)) - 1.0
    return change


def _covered(term: Json, piece: Json) -> float:
    """Share of the amplitudes whose 95 % interval holds the truth."""
    estimates = {e["name"]: e for e in term["estimates"]}
    inside = []
    if piece["cause"] == "parameter":
        e = estimates.get(term["term"]["hypothesis"]["free"][0]["name"]) if estimates else None
        if e is not None and e["low"] is not None and e["high"] is not None:
            ends = sorted(_change(term, piece, _number(e[end])) for end in ("low", "high"))
            inside.append(ends[0] <= piece["numbers"][piece["kind"]] <= ends[1])
        return _mean([float(one) for one in inside])
    for name in piece["amplitudes"]:
        e = estimates.get(name)
        if e is not None and e["low"] is not None and e["high"] is not None and piece["numbers"][name]:
            inside.append(e["low"] <= piece["numbers"][name] <= e["high"])
    return _mean([float(one) for one in inside])


def _overlap(piece: Json, term: Json) -> float:
    """Of what acts for a moment: intersection over union of its time and of the time that is said."""
    if "start" not in piece["numbers"] or term.get("start") is None or term.get("stop") is None:
        return NAN
    begin, end = piece["numbers"]["start"], piece["numbers"]["start"] + piece["numbers"]["duration"]
    both = max(0.0, min(end, term["stop"]) - max(begin, term["start"]))
    return both / (max(end, term["stop"]) - min(begin, term["start"]))


def _number(value: Any) -> float:
    return NAN if value is None else float(value)


def _share(values: Any) -> float:
    return _mean([float(value) for value in values])


def _mean(values: Sequence[float]) -> float:
    good = [value for value in values if np.isfinite(value)]
    return float(np.mean(good)) if good else NAN
