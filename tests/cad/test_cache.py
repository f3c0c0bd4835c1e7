"""Does the cache give back what was put, survive whatever happens to its files, and never stop the work?"""

import multiprocessing
import os

import numpy as np
import pytest

from rille.cad.files import cache

ARRAYS = {"a": np.arange(6.0).reshape(2, 3), "b": np.array([1, 2], np.int32)}


@pytest.fixture(autouse=True)
def _folder(tmp_path, monkeypatch):
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache"))


def same(arrays):
    return arrays is not None and all(np.array_equal(arrays[k], v) and arrays[k].dtype == v.dtype for k, v in ARRAYS.items())


def test_what_was_put_comes_back():
    assert cache.get("key") is None
    assert cache.put("key", ARRAYS)
    assert same(cache.get("key"))
    assert cache.get("other") is None
    assert cache.size() > 0
    cache.clear()
    assert cache.get("key") is None
    assert cache.size() == 0


@pytest.mark.parametrize(
    "damage", [lambda data: data[: len(data) // 2], lambda data: b"", lambda data: data[:200] + b"\xff" * 60 + data[260:]]
)
def test_damaged_entries_are_forgotten(damage):
    cache.put("key", ARRAYS)
    (file,) = cache.folder().glob("??/*.npz")
    file.write_bytes(damage(file.read_bytes()))
    assert cache.get("key") is None
    assert not file.exists()
    assert cache.put("key", ARRAYS)
    assert same(cache.get("key"))


def test_objects_are_not_unpickled():
    cache.put("key", ARRAYS)
    (file,) = cache.folder().glob("??/*.npz")
    np.savez(file, a=np.array([print], object))
    assert cache.get("key") is None


def test_another_version_has_other_entries(monkeypatch):
    found = []
    for version in ("one", "another", "one"):
        monkeypatch.setenv("RILLE_CACHE_VERSION", version)
        cache.version.cache_clear()
        found.append(cache.get("key"))
        cache.put("key", ARRAYS)
    cache.version.cache_clear()
    assert found[:2] == [None, None]
    assert same(found[2])


def test_a_folder_that_cannot_be_written_is_replaced(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "file" / "cache"))
    assert cache.put("key", ARRAYS)
    assert same(cache.get("key"))
    assert not cache.folder().is_relative_to(tmp_path)


def test_a_full_disk_is_no_error(monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    cache.folder()
    monkeypatch.setattr(np, "savez", full)
    assert not cache.put("key", ARRAYS)
    assert cache.get("key") is None
    assert not list(cache.folder().glob("??/*"))


def _write(key):
    return all(cache.put(key, {"a": np.full(1000, k)}) and cache.get(key) is not None for k in range(20))


def test_many_writers_of_one_key():
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        assert all(pool.map(_write, ["key"] * 4))
    assert len(set(cache.get("key")["a"])) == 1


def test_what_was_not_used_for_longest_goes_first():
    for k in range(5):
        cache.put(str(k), {"a": np.zeros(1000)})
    for k, file in enumerate(sorted(cache.folder().glob("??/*.npz"), key=lambda f: f.stat().st_mtime_ns)):
        os.utime(file, (k, k))
    assert cache.get("0") is not None  # used just now
    cache.prune(limit=3 * 8400)
    assert [k for k in range(5) if cache.has(str(k))] == [0, 3, 4]
