"""Can a truth be fixed before the answers, and neither guessed nor changed?"""

import hashlib
import json
import stat

import numpy as np
import pytest

from rille.model import InputRefused
from rille.model.ledger import ProofPlan, SealedTrial
from rille.proof.seal import answered, canonical_json, chain_hash, chain_start, conceal, files_digest, merkle_root, seal
from rille.proof.vault import read_vault, write_vault

# Test vectors of Certificate Transparency (github.com/google/certificate-transparency, merkle_tree_test): leaves, roots of the first n.
LEAVES = ("", "00", "10", "2021", "3031", "40414243", "5051525354555657", "606162636465666768696a6b6c6d6e6f")
ROOTS = (
    "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855",
    "6e340b9cffb37a989ca544e6bb780a2c78901d3fb33738768511a30617afa01d",
    "fac54203e7cc696cf0dfcb42c92a1d9dbaf70ad9e621f4bd8d98662f00e3c125",
    "aeb6bcfe274b70a14fb067a5e5578264db0fa9b51af5e0ba159158f329e06e77",
    "d37ee418976dd95753c1c73862b9398fa2a2cf9b4ff0fdfe8b30cd95209614b7",
    "4e3bbb1f7b478dcfe71fb631631519a3bca12c9aefca1612bfce4c13a86264d4",
    "76e67dadbcdf1e10e1b74ddc608abd2f98dfb16fbce75277b5232a127f2087ef",
    "ddb89be403809e325750d3d263cd78929c2942b7942a34b77e122c9594a74c8c",
    "5dc9da79a70659a9ad559cb701ded9a2ab9d823aad2f4960cfe370eff4604328",
)


def test_canonical_json_is_one_text_of_one_value():
    one = {"b": [1, 2.5, -0.1], "a": {"y": None, "x": "Größe"}, "t": (True,)}
    other = {"t": [True], "a": {"x": "Größe", "y": None}, "b": (1, np.float64(2.5), -0.1)}
    assert canonical_json(one) == canonical_json(other) == '{"a":{"x":"Größe","y":null},"b":[1,2.5,-0.1],"t":[true]}'
    assert canonical_json(json.loads(canonical_json(one))) == canonical_json(one)


@pytest.mark.parametrize(
    ("value", "word"),
    [
        ({"a": [{"b": float("nan")}]}, "a[0].b"),
        ({"a": float("-inf")}, "'a' is -inf"),
        ({"a": {1: 2}}, "key 1"),
        ({"a": np.zeros(2)}, "ndarray"),
        ({"a": np.int64(1)}, "int64"),
    ],
)
def test_what_json_cannot_say_is_refused_with_its_place(value, word):
    with pytest.raises(InputRefused) as refused:
        canonical_json(value)
    assert word in str(refused.value)


def test_a_seal_opens_with_its_own_truth_and_nonce_only():
    truth, again = conceal(0, {"kind": "backlash"}), conceal(0, {"kind": "backlash"})
    assert seal(truth) == hashlib.sha256(b'{"kind":"backlash"}' + truth.nonce).hexdigest()
    assert len(truth.nonce) == 32
    assert truth.nonce != again.nonce
    assert seal(truth) != seal(again)


def test_the_merkle_root_is_that_of_rfc_6962():
    assert tuple(merkle_root(LEAVES[:n]) for n in range(len(LEAVES) + 1)) == ROOTS


def test_a_node_cannot_pass_for_a_leaf():
    left, right = (hashlib.sha256(b"\x00" + bytes([k])).digest() for k in (0, 1))
    assert merkle_root(["00", "01"]) != merkle_root([(left + right).hex()])


def test_answers_are_chained_to_the_root_the_plan_and_each_other():
    plan = ProofPlan(beacon="b", version="1", code="c", isolation="none", counts={"one": 1}, root="r", sealed=5)
    trial = SealedTrial(number=0, machine="arm", seal="s", recording="f")
    start = chain_start(plan, [trial])
    first = answered(start, 0, "done", "{}", "f", 1, 10, 11)
    assert first.chain == chain_hash(first)
    assert answered(first.chain, 1, "done", "{}", "f", 1, 10, 11).chain != answered(start, 1, "done", "{}", "f", 1, 10, 11).chain
    for other in ("beacon", "root", "code"):
        assert chain_start(ProofPlan(**{**_fields(plan), other: "x"}), [trial]) != start


def _fields(plan):
    return {name: getattr(plan, name) for name in plan.__slots__}


def test_the_digest_of_a_folder_tells_names_and_contents_apart(tmp_path):
    for name, texts in (("a", {"x.csv": "1", "y.csv": "2"}), ("b", {"x.csv": "2", "y.csv": "1"}), ("c", {"y.csv": "2", "x.csv": "1"})):
        (tmp_path / name).mkdir()
        for file, text in texts.items():
            (tmp_path / name / file).write_text(text)
    (tmp_path / "c/__pycache__").mkdir()
    (tmp_path / "c/__pycache__/z.csv").write_text("made by Python")
    assert files_digest(tmp_path / "a") == files_digest(tmp_path / "c", [".csv"]) != files_digest(tmp_path / "b")
    with pytest.raises(InputRefused, match=r"no file that ends in \.py"):
        files_digest(tmp_path, [".py"])


def test_the_vault_keeps_the_truths_for_its_owner_and_is_written_once(tmp_path):
    truths = tuple(conceal(k, {"kind": f"k{k}"}) for k in range(5))
    path = tmp_path / "vault/truths.json"
    root = write_vault(path, truths[::-1])
    assert root == merkle_root([seal(t) for t in truths])
    assert read_vault(path, root) == truths
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    assert [file.name for file in path.parent.iterdir()] == [path.name]
    with pytest.raises(InputRefused, match="holds the truths of a sealed plan"):
        write_vault(path, truths)
    assert read_vault(path) == truths
    with pytest.raises(InputRefused, match="is of the plan with root"):
        read_vault(path, "0" * 64)


def test_a_vault_that_was_half_written_is_written_anew(tmp_path):
    (tmp_path / "v.json.part").write_text('{"root": "')
    truths = (conceal(0, {}),)
    write_vault(tmp_path / "v.json", truths)
    assert read_vault(tmp_path / "v.json") == truths


def test_a_vault_is_refused_where_it_was_changed_or_others_may_read_it(tmp_path):
    path = tmp_path / "v.json"
    write_vault(path, [conceal(0, {"kind": "backlash"})])
    whole = path.read_text()
    path.write_text(whole.replace("backlash", "friction"))
    with pytest.raises(InputRefused, match="was changed"):
        read_vault(path)
    path.write_text(whole[:40])
    with pytest.raises(InputRefused, match="is damaged"):
        read_vault(path)
    path.write_text(whole)
    path.chmod(0o644)
    with pytest.raises(InputRefused, match="mode 644"):
        read_vault(path)
    with pytest.raises(InputRefused, match="no vault"):
        read_vault(tmp_path / "other.json")


def test_a_vault_refuses_a_nonce_that_is_used_twice(tmp_path):
    truth = conceal(0, {})
    with pytest.raises(InputRefused, match="no two alike"):
        write_vault(tmp_path / "v.json", [truth, truth])
