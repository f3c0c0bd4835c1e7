"""Tables and picture of scored trials: what was named, grouped, left open, wrong."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scoring import median
from trials import trial_named

from rille.model.diagnosis import NAMING

Line = dict
CAUSES = {"effect": "missing effect", "parameter": "wrong number", "sensor": "sensor fault", "none": "nothing wrong"}


def write_tables(lines: Sequence[Line], folder: Path) -> None:
    """``results.json``, ``results.md`` and ``confusion.png`` in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    done = [line for line in lines if line["status"] == "done"]
    rows = {"by strength": _grouped(done, lambda t: (CAUSES[t.cause], f"{t.strength:g}"))}
    rows["by machine at twice the floor"] = _grouped(_at(done, 2.0), lambda t: (CAUSES[t.cause], t.machine))
    rows["by effect at twice the floor"] = _grouped(
        [line for line in _at(done, 2.0) if "/effect/" in line["trial"]], lambda t: (t.kind, "")
    )
    nulls = [line for line in done if "/none/" in line["trial"]]
    summary = {
        "trials": len(done),
        "unreachable": sorted(line["trial"] for line in lines if line["status"] == "unreachable"),
        "failed": {
            line["trial"]: line["status"] + ": " + line.get("message", "")[-300:]
            for line in lines
            if line["status"] in ("crashed", "too long")
        },
        "nulls": len(nulls),
        "false_mechanism_on_nulls": sum(line["score"]["verdict"] in NAMING for line in nulls),
        "nulls_not_called_complete": sum(line["score"]["verdict"] != "nothing_missing" for line in nulls),
        "tables": rows,
    }
    compact = [{"trial": line["trial"], "truth": line["truth"], "score": line["score"]} for line in done]
    (folder / "results.json").write_text(json.dumps({**summary, "scores": compact}, indent=1, default=float) + "\n", encoding="utf-8")
    (folder / "results.md").write_text(_markdown(summary), encoding="utf-8")
    _confusion(done, folder / "confusion.png")


def _at(lines: Sequence[Line], strength: float) -> list[Line]:
    return [line for line in lines if trial_named(line["trial"]).strength in (0.0, strength)]


def _grouped(lines: Sequence[Line], key: Callable) -> list[dict]:
    groups: dict[tuple, list[dict]] = {}
    for line in lines:
        trial = trial_named(line["trial"])
        groups.setdefault(key(trial), []).append({**line["score"], "null": trial.cause == "none"})
    return [{"what": " ".join(filter(None, name)), **_row(scores)} for name, scores in sorted(groups.items())]


def _row(scores: Sequence[dict]) -> dict:
    def share(word: str) -> float:
        return 100 * float(np.mean([score[word] for score in scores]))

    null = scores[0]["null"]
    return {
        "n": len(scores),
        "top": float("nan") if null else share("top"),
        "group": float("nan") if null else share("grouped"),
        "class": share("classed"),
        "abstained": share("abstained"),
        "wrong": share("wrong"),
        "target": float("nan") if null else share("target"),
        "located": float("nan") if null else share("located"),
        "error": 100 * median([score["error"] for score in scores]),
        "gap": median([score["gap"] for score in scores if score["grouped"]]),
        "seconds": median([score["seconds"] for score in scores]),
    }


HEADER = (
    "| what | n | right name % | right group % | right sort % | abstained % | wrong name % | right target % | located % "
    "| amplitude off by % | G | s |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n"
)


def _markdown(summary: dict) -> str:
    text = [f"{summary['trials']} trials; {len(summary['unreachable'])} more could not be made strong enough on their machine, "]
    text.append(f"{len(summary['failed'])} crashed or took too long.\n")
    text.append(f"Nothing wrong: {summary['nulls']} trials, {summary['false_mechanism_on_nulls']} with a name all the same, ")
    text.append(f"{summary['nulls_not_called_complete']} not called complete.\n")
    for title, rows in summary["tables"].items():
        text.append(f"\n{title[0].upper() + title[1:]}\n\n{HEADER}")
        for row in rows:
            whole = [f"{row[k]:.0f}" for k in ("top", "group", "class", "abstained", "wrong", "target", "located")]
            cells = [row["what"], str(row["n"]), *whole, f"{row['error']:.1f}", f"{row['gap']:.2f}", f"{row['seconds']:.0f}"]
            text.append("| " + " | ".join("" if cell == "nan" else cell for cell in cells) + " |\n")
    return "".join(text)


def _confusion(lines: Sequence[Line], file: Path) -> None:
    """Truth by answer, in kinds, at twice the floor and above; a group counts as the truth where it holds it."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    count: dict[tuple[str, str], int] = {}
    for line in lines:
        trial, score = trial_named(line["trial"]), line["score"]
        if 0 < trial.strength < 2:
            continue
        truth = trial.kind if trial.cause != "none" else "nothing"
        truth = f"sensor: {truth}" if trial.cause == "sensor" else f"number: {truth}" if trial.cause == "parameter" else truth
        kind = score["answer"].split(" of ")[0].split(" + ")[0]
        answer = truth if score["grouped"] else kind if score["verdict"] in NAMING else score["verdict"].replace("_missing", "")
        if score["verdict"] == "sensor_fault" and not score["grouped"]:
            answer = f"sensor: {kind}"
        count[truth, answer] = count.get((truth, answer), 0) + 1
    if not count:
        return
    truths = sorted({t for t, _ in count}, key=lambda t: (t == "nothing", ":" in t, t))
    others = sorted({a for _, a in count} - set(truths), key=lambda a: (a not in ("unknown", "cannot_know"), a))
    answers = [*truths, *others]
    table = np.zeros((len(truths), len(answers)))
    for (truth, answer), n in count.items():
        table[truths.index(truth), answers.index(answer)] = n
    share = table / table.sum(axis=1, keepdims=True)
    figure, axes = plt.subplots(figsize=(3 + 0.24 * len(answers), 2 + 0.24 * len(truths)), layout="constrained")
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="equal")
    for i, j in np.argwhere(table > 0).tolist():
        axes.text(j, i, f"{table[i, j]:.0f}", ha="center", va="center", fontsize=6, color="white" if share[i, j] > 0.5 else "black")
    axes.set_xticks(range(len(answers)), answers, rotation=90, fontsize=7)
    axes.set_yticks(range(len(truths)), truths, fontsize=7)
    axes.set_xlabel("answer (the truth where its group holds it)")
    axes.set_ylabel("what was wrong")
    axes.set_title("Diagnosis of recordings with one thing wrong, at twice the noise floor and above", fontsize=9)
    figure.savefig(file, dpi=150)
    plt.close(figure)
