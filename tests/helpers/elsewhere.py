"""This process without what Windows or macOS lacks, and with what they do otherwise, as far as a process can tell.

Where the environment has COLLIDE_TESTS_SYSTEM = windows or macos, importing this takes it away, and then imports
collide, to which `sys.platform` is the other system's. So whole files of tests run without it:
`python -m pytest -p tests.helpers.elsewhere`. Those that have the mark `unix` are left out on Windows.

The lists are the notes on availability of Python's documentation, of 3.11 to 3.14:
https://docs.python.org/3/library/os.html, signal.html, time.html, mmap.html, select.html, ctypes.html and unix.html.
What the systems do otherwise is said there too, under os.chmod, os.fsync, os.open, os.rename, os.replace, os.remove and
signal.signal; and in Microsoft's of MoveFileExW, CreateFileW, CreateDirectoryW, RemoveDirectoryW, GlobalMemoryStatusEx,
in Apple's of rename(2), fsync(2), fcntl(2) and sysctl(3).
"""

import builtins
import contextlib
import ctypes
import errno
import fnmatch
import functools
import importlib
import io
import os
import signal
import stat
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType, SimpleNamespace
from typing import Any

# By the modules, which some lack altogether; and names, in which * is any ending.
LACKS = {
    "windows": {
        **dict.fromkeys(
            ["crypt", "curses", "fcntl", "grp", "nis", "ossaudiodev", "posix", "pty", "pwd", "readline"], "*"
        ),
        **dict.fromkeys(["resource", "spwd", "syslog", "termios", "tty"], "*"),
        "os": """
            CLD_* CLONE_* EFD_* EX_[!O]* EX_OS* F_LOCK F_TEST F_TLOCK F_ULOCK GRND_* MFD_* NGROUPS_MAX PIDFD_* POSIX_*
            PRIO_* P_ALL P_PGID P_PID P_PIDFD RTLD_* RWF_* SCHED_* SEEK_DATA SEEK_HOLE SPLICE_* ST_* TFD_* W[A-Z]*
            XATTR_* O_ACCMODE O_ASYNC O_CLOEXEC O_DIRECT O_DIRECTORY O_DSYNC O_FSYNC O_LARGEFILE O_NDELAY O_NOATIME
            O_NOCTTY O_NOFOLLOW O_NONBLOCK O_PATH O_RSYNC O_SYNC O_TMPFILE
            chown chroot confstr* copy_file_range ctermid environb eventfd* fchdir fchown fdatasync fork forkpty
            fpathconf fstatvfs fwalk getegid getenvb geteuid getgid getgrouplist getgroups getloadavg getpgid getpgrp
            getpriority getrandom getres* getsid getuid getxattr grantpt initgroups killpg lchown listxattr lockf
            login_tty major makedev memfd_create minor mkfifo mknod nice openpty pathconf* pidfd_open pipe2 posix_*
            pread* ptsname pwrite* readv register_at_fork removexattr sched_* sendfile setegid seteuid setgid setgroups
            setns setpgid setpgrp setpriority setre* setsid setuid setxattr spawnlp* spawnvp* splice statvfs sync
            sysconf* tcgetpgrp tcsetpgrp timerfd_* ttyname uname unlockpt unshare wait wait3 wait4 waitid* writev
            fchmod lchmod get_blocking set_blocking
        """,
        "signal": """
            ITIMER_* ItimerError SIGALRM SIGBUS SIGCHLD SIGCLD SIGCONT SIGHUP SIGIO SIGIOT SIGKILL SIGPIPE SIGPOLL
            SIGPROF SIGPWR SIGQUIT SIGRT* SIGSTKFLT SIGSTOP SIGSYS SIGTRAP SIGTSTP SIGTTIN SIGTTOU SIGURG SIGUSR*
            SIGVTALRM SIGWINCH SIGX* SIG_BLOCK SIG_SETMASK SIG_UNBLOCK Sigmasks alarm getitimer pause pidfd_send_signal
            pthread_* setitimer siginterrupt sigpending sigtimedwait sigwait* struct_siginfo
        """,
        "mmap": "MADV_* MAP_* PROT_*",  # and the method madvise
        "time": "CLOCK_* clock_* pthread_getcpuclockid tzset",
        "select": "EPOLL* PIPE_BUF POLL* epoll poll",
        "sys": "abiflags getdlopenflags setdlopenflags",
    },
    "macos": {
        **dict.fromkeys(["ossaudiodev", "spwd"], "*"),
        "os": """
            CLONE_* EFD_* GRND_* MFD_* O_DIRECT O_LARGEFILE O_NOATIME O_PATH O_RSYNC O_TMPFILE PIDFD_* POSIX_FADV_*
            POSIX_SPAWN_CLOSEFROM P_PIDFD RTLD_DEEPBIND RWF_* SCHED_BATCH SCHED_IDLE SCHED_RESET_ON_FORK SPLICE_*
            ST_APPEND ST_MANDLOCK ST_NOATIME ST_NODEV ST_NODIRATIME ST_NOEXEC ST_RELATIME ST_SYNCHRONOUS ST_WRITE
            TFD_* XATTR_* copy_file_range eventfd* fdatasync getrandom getres* getxattr listxattr memfd_create
            pidfd_open pipe2 posix_fadvise posix_fallocate removexattr sched_get[aps]* sched_rr_get_interval sched_set*
            setns setres* setxattr splice timerfd_* unshare waitid*
        """,
        "signal": "SIGCLD SIGPOLL SIGPWR SIGRT* SIGSTKFLT pidfd_send_signal sigtimedwait sigwaitinfo struct_siginfo",
        "mmap": "MADV_DODUMP MADV_DOFORK MADV_DONTDUMP MADV_DONTFORK MADV_HUGEPAGE MADV_HWPOISON MADV_*MERGEABLE "
        "MADV_NOHUGEPAGE MADV_REMOVE MAP_DENYWRITE MAP_EXECUTABLE MAP_POPULATE MAP_STACK",
        "time": "CLOCK_BOOTTIME CLOCK_TAI pthread_getcpuclockid",
        "select": "EPOLL* POLLMSG POLLRDHUP epoll",
        "fcntl": "DN_* FICLONE* F_ADD_SEALS F_EXLCK F_GETLK64 F_GETPIPE_SZ F_GETSIG F_GET_SEALS F_NOTIFY F_SEAL_* "
        "F_SETLK*64 F_*_RW_HINT F_*OWN_EX F_OWNER_* F_SETPIPE_SZ F_SETSIG F_SHLCK RWH_* LOCK_MAND "
        "LOCK_READ LOCK_RW LOCK_WRITE",
        "resource": "RLIMIT_MSGQUEUE RLIMIT_NICE RLIMIT_OFILE RLIMIT_RT* RLIMIT_SIGPENDING RUSAGE_THREAD prlimit",
    },
}
# What has come with a Python that is newer than the oldest.
HAS_SINCE = {
    "windows": {"fchmod": (3, 13), "lchmod": (3, 13), "get_blocking": (3, 12), "set_blocking": (3, 12)},
    "macos": {"waitid": (3, 13), "waitid_result": (3, 13)},
}
SYSTEMS = tuple(LACKS)
PLATFORMS = {"windows": "win32", "macos": "darwin"}
TOTAL, FREE = 16 << 30, 6 << 30  # bytes of memory that the other system has

# What others use of Unix as they are imported.
_FIRST = """
    asyncio concurrent.futures.process ctypes.util dask.array hypothesis llvmlite.binding mpmath multiprocessing.pool
    numba numba.np.ufunc numpy.testing pandas polars pyarrow.compute pyarrow.csv pyarrow.dataset pyarrow.parquet
    subprocess tempfile tqdm xarray zipfile
"""


def lacks(system: str, module: str, name: str = "") -> bool:
    """Whether a system lacks, on some Python, what has this name in a module, or, with no name, the module."""
    patterns = LACKS[system].get(module, "").split()
    return any(fnmatch.fnmatchcase(name, p) for p in patterns) if name else patterns == ["*"]


def move_to(system: str) -> None:
    """Takes away, and imports collide as the other system would."""
    for name in _FIRST.split():
        importlib.import_module(name)
    # What goes stays as it was for what is here, and for what starts processes and makes temporary files.
    real = SimpleNamespace(**vars(os), io_open=io.open, CDLL=ctypes.CDLL, fcntl=importlib.import_module("fcntl"))
    vars(sys.modules["subprocess"]).update(os=real, signal=SimpleNamespace(**vars(signal)))
    vars(sys.modules["tempfile"]).update(_os=real)
    for module in LACKS[system]:
        if lacks(system, module):
            vars(sys)["modules"][module] = None
        else:
            there = sys.modules.get(module) or importlib.import_module(module)
            for name in [name for name in vars(there) if lacks(system, module, name)]:
                if sys.version_info < HAS_SINCE[system].get(name, (99,)):
                    delattr(there, name)
    vars(os).update(process_cpu_count=os.cpu_count)
    _without_linux(real)
    {"windows": _windows, "macos": _macos}[system](real)
    here, sys.platform = sys.platform, PLATFORMS[system]
    try:
        importlib.import_module("collide")
        for path in Path(str(sys.modules["collide"].__file__)).parent.glob("_system/[!_]*.py"):
            importlib.import_module(f"collide._system.{path.stem}")
    finally:
        sys.platform = here


def _for_collide(function: Callable[..., Any], usual: Callable[..., Any]) -> Callable[..., Any]:
    """The function where collide calls it, by whatever of the standard library; the usual one for all others."""

    @functools.wraps(usual)
    def call(*arguments: Any, **options: Any) -> Any:
        frame: FrameType | None = sys._getframe(1)
        while frame and not frame.f_globals.get("__name__", "").startswith("collide."):
            frame = frame.f_back
        return (function if frame else usual)(*arguments, **options)

    return call


def _without_linux(real: SimpleNamespace) -> None:
    """No /proc and no /sys."""

    def open_(path: Any, *arguments: Any, **options: Any) -> Any:
        if isinstance(path, str | os.PathLike) and os.fspath(path).startswith(("/proc/", "/sys/")):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), path)
        return real.io_open(path, *arguments, **options)

    io.open = builtins.open = _for_collide(open_, real.io_open)


class _Library:
    """The C library of macOS, as ctypes.CDLL(None) finds it."""

    def __init__(self, real: SimpleNamespace) -> None:
        self._renameat2 = real.CDLL(None, use_errno=True).renameat2

    def renamex_np(self, one: bytes, other: bytes, flags: int) -> Any:
        how = {0x2: 2, 0x4: 1}[flags]  # RENAME_SWAP and RENAME_EXCL, by what Linux has for them
        return self._renameat2(-100, one, -100, other, how)

    def sysctlbyname(self, name: bytes, value: Any, size: Any, new: Any, new_size: Any) -> int:
        told = {b"hw.memsize": (8, TOTAL), b"kern.memorystatus_level": (4, 100 * FREE // TOTAL)}
        n_bytes, number = told[name]
        assert (size._obj.value, ctypes.sizeof(value._obj), new, new_size.value) == (n_bytes, n_bytes, None, 0)
        value._obj.value = number
        return 0


def _macos(real: SimpleNamespace) -> None:
    vars(ctypes).update(CDLL=lambda name, *a, **k: _Library(real) if name is None else real.CDLL(name, *a, **k))
    fcntl, fcntl_fcntl = real.fcntl, real.fcntl.fcntl
    fcntl.F_FULLFSYNC = 51

    def full_sync(handle: int, command: int, *arguments: Any) -> Any:
        return os.fsync(handle) if command == fcntl.F_FULLFSYNC else fcntl_fcntl(handle, command, *arguments)

    fcntl.fcntl = full_sync


def _windows(real: SimpleNamespace) -> None:
    def error(number: int, code: int, path: Any) -> OSError:
        made = OSError(number, os.strerror(number), os.fspath(path))
        vars(made).update(winerror=code)
        return made

    def in_use(path: Any) -> bool:
        """What is open, or mapped, by this process; of a folder, something in it."""
        names = {os.path.realpath(path)}
        with contextlib.suppress(FileNotFoundError), real.io_open("/proc/self/maps") as maps:
            held = {line.split(maxsplit=5)[5].rstrip("\n") for line in maps if line.count("/") > 1}
        for handle in real.listdir("/proc/self/fd"):
            with contextlib.suppress(FileNotFoundError):
                held.add(real.readlink(f"/proc/self/fd/{handle}"))
        return any(path == name or path.startswith(f"{name}/") for path in held for name in names)

    def refuse_what_is_in_use(*paths: Any) -> None:
        for path in paths:
            if os.path.lexists(path) and not Path(path).is_symlink() and in_use(path):
                raise error(errno.EACCES, 32, path)  # ERROR_SHARING_VIOLATION

    def read_only(path: Any) -> bool:
        return Path(path).is_file() and not Path(path).stat().st_mode & stat.S_IWUSR

    def rename(one: Any, other: Any, **folders: Any) -> None:
        refuse_what_is_in_use(one)
        if os.path.lexists(other):
            raise error(errno.EEXIST, 183, other)  # ERROR_ALREADY_EXISTS
        real.rename(one, other, **folders)

    def replace(one: Any, other: Any, **folders: Any) -> None:
        refuse_what_is_in_use(one, other)
        if Path(other).is_dir() or read_only(other):
            raise error(errno.EACCES, 5, other)  # ERROR_ACCESS_DENIED
        real.replace(one, other, **folders)

    def remove(path: Any, **folder: Any) -> None:
        refuse_what_is_in_use(path)
        if read_only(path):
            raise error(errno.EACCES, 5, path)
        real.remove(path, **folder)

    def rmdir(path: Any, **folder: Any) -> None:
        refuse_what_is_in_use(path)
        real.rmdir(path, **folder)

    def open_(path: Any, flags: int, mode: int = 0o777, **folder: Any) -> Any:
        if Path(path).is_dir():
            raise error(errno.EACCES, 5, path)
        return real.open(path, flags, mode if mode & 0o200 else 0o444, **folder)

    def mkdir(path: Any, mode: int = 0o777, **folder: Any) -> None:
        real.mkdir(path, 0o700 if mode == 0o700 else 0o777, **folder)  # "Changed in version 3.13", and 3.12.4

    def chmod(path: Any, mode: int, **options: Any) -> None:
        if not Path(path).is_dir():
            real.chmod(path, 0o666 if mode & 0o200 else 0o444, **options)

    def fsync(handle: int) -> None:
        if real.fcntl.fcntl(handle, real.fcntl.F_GETFL) & real.O_ACCMODE == real.O_RDONLY:
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        real.fsync(handle)

    functions = {f.__name__: f for f in (rename, replace, remove, rmdir, mkdir, chmod, fsync)}
    for name, function in {**functions, "unlink": remove, "open": open_}.items():
        setattr(os, name, _for_collide(function, getattr(real, name)))

    allowed = {signal.SIGABRT, signal.SIGFPE, signal.SIGILL, signal.SIGINT, signal.SIGSEGV, signal.SIGTERM, 21}
    vars(signal).update(SIGBREAK=21)

    def only_allowed(function: Callable[..., Any], number: int, *handler: Any) -> Any:
        if number not in allowed:
            raise ValueError("invalid signal value")
        return function(number, *handler)

    for name in ("signal", "getsignal"):
        setattr(signal, name, functools.partial(only_allowed, getattr(signal, name)))

    def library(name: Any, *arguments: Any, **options: Any) -> Any:
        if name is None:
            raise TypeError("bad argument type for built-in operation")
        return real.CDLL(name, *arguments, **options)

    def global_memory_status_ex(status: Any) -> int:
        place, size = ctypes.addressof(status._obj), ctypes.sizeof(status._obj)
        assert (size, ctypes.c_uint32.from_address(place).value) == (64, 64)
        ctypes.memmove(place, struct.pack("<2I7Q", 64, 62, TOTAL, FREE, *[1 << 40] * 5), 64)
        return 1

    vars(ctypes).update(
        CDLL=library,
        windll=SimpleNamespace(kernel32=SimpleNamespace(GlobalMemoryStatusEx=global_memory_status_ex)),
        FormatError=lambda code: f"the system's words for {code}",
    )


def pytest_collection_modifyitems(config: Any, items: list[Any]) -> None:
    left_out = [item for item in items if SYSTEM == "windows" and item.get_closest_marker("unix")]
    items[:] = [item for item in items if item not in left_out]
    config.hook.pytest_deselected(items=left_out)


SYSTEM = os.environ.get("COLLIDE_TESTS_SYSTEM")  # None: the one that it is
if SYSTEM:
    move_to(SYSTEM)
