"""The cache of compiled kernels: found again, never damaged or another's, and never a reason to fail."""

import importlib.machinery
import os
import pickle
import sys
import time
from pathlib import Path

import pytest
from numba import types
from numba.core import config

import collide
from collide._compile import cache as _cache
from collide._compile import kernel as _kernel
from collide._system import ownership

pytestmark = pytest.mark.fast


@pytest.mark.parametrize(
    ("said", "cache"),
    [("/said", "/said"), *((said, f"/home/{ownership._CACHES}") for said in ("said", "", None))],
    ids=["absolute", "relative", "empty", "not set"],
)
def test_a_home_for_caches_that_is_not_absolute_is_ignored(said, cache, monkeypatch):
    """As the XDG Base Directory Specification says."""
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setenv("HOME", "/home")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    if said is not None:
        monkeypatch.setenv("XDG_CACHE_HOME", said)
    beside = Path(collide.__file__).parent / "__pycache__"
    assert _cache.folders() == [beside, Path(cache) / "collide"]
    monkeypatch.setenv("HOME", "home")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    assert _cache.folders() == [beside]


# A kernel that takes no time to compile, in a cache of its own


def add(x, y):
    return x + y


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "kernels"))
    return tmp_path / "kernels" / "collide"


@pytest.fixture
def loads(cache, monkeypatch):
    """A function: whether a kernel that has not been called yet is found in the cache; it works anyhow."""
    found = []

    def load_overload(self, *arguments):
        found.append(original(self, *arguments))
        return found[-1]

    original = _cache.DiskCache.load_overload
    monkeypatch.setattr(_cache.DiskCache, "load_overload", load_overload)

    def call():
        assert _kernel.Kernel(add, types.int64(types.int64, types.int64), "add").compiled(3, 4) == 7
        return found.pop() is not None

    return call


def only(cache):
    (path,) = cache.iterdir()
    return path


def rewrite(change):
    def damage(path):
        path.write_bytes(change(path.read_bytes()))

    return damage


def of_another_kind(path):
    """Whole, by its checksum, and yet no kernel."""
    _cache._write(path, ownership.owners()[0], pickle.dumps("no kernel"))


def under_another_name(path):
    """A kernel of one's own, whole, and not the one."""
    other = path.with_name(f"other-{path.name}")
    _cache._write(other, ownership.owners()[0], path.read_bytes()[32:])
    other.replace(path)


def a_link(path):
    """To what the user owns and nobody else can write, which is not to say that he wrote it."""
    path.rename(path.parent.parent / "kernel")
    path.symlink_to(path.parent.parent / "kernel")


def of_another_user(path):
    if sys.platform == "win32":
        pytest.skip("Windows has no os.chown: files there are of no user that could be another")
    os.chown(path, 12345, -1)


DAMAGE = {
    "empty": rewrite(lambda content: b""),
    "truncated": rewrite(lambda content: content[: len(content) // 2]),
    "garbage": rewrite(lambda content: bytes(range(256)) * 40),
    "one bit flipped": rewrite(lambda content: content[:-100] + bytes([content[-100] ^ 1]) + content[-99:]),
    "of another kind": of_another_kind,
    "under another name": under_another_name,
}
OTHERS = {
    "a link": a_link,
    "writable by the group": lambda path: path.chmod(0o664),
    "writable by all": lambda path: path.chmod(0o646),
    **({"of another user": of_another_user} if ownership.owners()[0] == 0 else {}),  # whom only root can imitate
}


@pytest.mark.parametrize("damage", [*DAMAGE, *(pytest.param(name, marks=pytest.mark.unix) for name in OTHERS)])
def test_damaged_or_foreign_kernel_is_not_run_but_replaced(damage, cache, loads):
    assert not loads()
    path = only(cache)
    assert loads()
    {**DAMAGE, **OTHERS}[damage](path)
    assert not loads()
    assert only(cache) == path
    assert path.is_file() and not path.is_symlink()
    assert loads()


def test_folder_in_a_kernels_place_stays_there(cache, loads):
    assert not loads()
    path = only(cache)
    path.unlink()
    path.mkdir()
    assert not loads()
    assert only(cache) == path


@pytest.mark.unix
def test_kernels_of_root_are_for_all(cache, loads, monkeypatch):
    """And users do not replace each other's."""
    if sys.platform == "win32":
        pytest.skip("Windows has no os.geteuid: nobody is root there")
    monkeypatch.setattr(ownership, "owners", lambda: (os.geteuid(), os.geteuid()))
    assert not loads()
    monkeypatch.setattr(ownership, "owners", lambda: (54321, os.geteuid()))
    assert loads()
    monkeypatch.setattr(ownership, "owners", lambda: (54321, 54321))
    before = only(cache), only(cache).read_bytes()
    assert not loads()
    assert (only(cache), only(cache).read_bytes()) == before


@pytest.mark.unix
@pytest.mark.parametrize("mask", [0o000, 0o022, 0o077])
def test_kernels_may_be_read_by_all_and_written_by_their_owner(mask, cache, loads):
    before = os.umask(mask)
    try:
        assert not loads()
    finally:
        os.umask(before)
    assert only(cache).stat().st_mode == 0o100644


@pytest.mark.unix
def test_nothing_is_kept_where_files_have_no_rights(cache, loads, monkeypatch):
    """It would never be read, and found anew in every process."""
    if sys.platform == "win32":
        pytest.skip("Windows has no os.fchmod: rights of files are not asked there")
    chmod = os.fchmod
    monkeypatch.setattr(os, "fchmod", lambda handle, mode: chmod(handle, 0o777))
    assert not loads()
    assert list(cache.iterdir()) == []


def test_folder_that_cannot_be_written_to_is_tried_once(cache, loads, monkeypatch):
    """tempfile tries other names there, 2**31 of them on Windows."""
    created = []

    def refuse(path, flags, *mode):
        if flags & os.O_CREAT:
            created.append(Path(path).parent)
        raise PermissionError

    cache.mkdir(parents=True)
    monkeypatch.setattr(os, "open", refuse)
    assert not loads()
    assert created == [cache]


# Which kernel it is

OTHER = {
    "OPT": config._OptLevel(1),
    "LOOP_VECTORIZE": 0,
    "SLP_VECTORIZE": 1,
    "BOUNDSCHECK": 1,
    "DEBUGINFO_DEFAULT": 1,
    "EXTEND_VARIABLE_LIFETIMES": 1,
    "LLVM_REFPRUNE_PASS": 0,
    "LLVM_REFPRUNE_FLAGS": "per_bb",
    "USING_SVML": True,
    "CPU_NAME": "generic",
    "CPU_FEATURES": "",
}


@pytest.mark.parametrize("name", OTHER)
def test_kernels_of_other_settings_are_others(name, cache, loads, monkeypatch):
    assert not loads()
    with monkeypatch.context() as other:
        other.setattr(config, name, OTHER[name])
        if not name.startswith("CPU_"):  # which Numba reads once in a process
            assert not loads()
            assert len([*cache.iterdir()]) == 2
    assert loads()


def test_kernels_of_another_python_are_others(cache, loads, monkeypatch):
    """3.14 and 3.14t have one cache_tag."""
    assert not loads()
    with monkeypatch.context() as other:
        other.setattr(importlib.machinery, "EXTENSION_SUFFIXES", [".cpython-314t-x86_64-linux-gnu.so"])
        assert not loads()
    assert loads()


def test_sources_in_subfolders_count(tmp_path, monkeypatch):
    monkeypatch.setattr(_cache, "_PACKAGE", tmp_path)
    seen = {_cache._sources_digest()}
    assert seen == {""}
    for place in ("a.py", "sub/a.py", "sub/b.py", "sub/sub/a.py"):
        (tmp_path / place).parent.mkdir(exist_ok=True)
        for text in ("", "1"):
            (tmp_path / place).write_text(text)
            seen.add(_cache._sources_digest())
    assert len(seen) == 9


# Old kernels


def test_kernels_that_were_not_used_for_a_month_are_removed(cache, loads):
    cache.mkdir(parents=True)
    key = "0123456789abcdef" * 2
    old = [f"line-float64-{key}.nbc", f"line-float64-{key}.nbc.0123.tmp"]
    recent = [f"plane-float64-{key}.nbc", f"plane-float64-{key}.nbc.0123.tmp"]
    foreign = ["mine.nbc", f"{key}.nbc", "module.function-1.py311.nbi", "module.function-1.py311.1.nbc", f"x-{key}.nbi"]
    for names, days in ((old, 31), (recent, 29), (foreign, 300)):
        for name in names:
            (cache / name).write_text("")
            os.utime(cache / name, (time.time() - days * 86_400,) * 2)
    assert not loads()
    kept = {path.name for path in cache.iterdir() if not path.name.startswith("add-")}
    assert kept == {*recent, *foreign}


@pytest.mark.parametrize(("hours", "marked"), [(1, False), (23, False), (25, True), (900, True)])
def test_use_is_marked_once_a_day(hours, marked, cache, loads):
    assert not loads()
    path, before = only(cache), time.time() - hours * 3600
    os.utime(path, (before, before))
    assert loads()
    assert abs(path.stat().st_mtime - (time.time() if marked else before)) < 60


# Never a reason to fail


class Broken:
    def __call__(self, *arguments, **options):
        raise RuntimeError("broken")


PARTS = ["folders", "_environment", "_sources_digest", "_read", "_write", "_remove_unused", "dumps", "time"]
PARTS += [f"ownership.{part}" for part in ("owners", "open_carefully", "show_to_others", "is_safe")]


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("after", [False, True], ids=["from the first call on", "later"])
def test_no_part_of_the_cache_fails_a_call(part, after, loads, monkeypatch):
    if after:
        loads()
    monkeypatch.setattr(f"collide._compile.cache.{part}", Broken())
    loads()
