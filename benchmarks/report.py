"""From pytest-benchmark's JSON to the README's table, in place between its markers, and to two pictures.

    python -m pytest benchmarks --benchmark-json=benchmarks/results/last.json
    python benchmarks/report.py benchmarks/results/last.json

Every contestant was timed in rounds interleaved with collide's. What is written as its rate is that ratio times the
rate of collide in a measurement of its own, so that a slow minute of the machine moves all figures of a column alike.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results"
BEGIN, END = "<!-- measured: written by benchmarks/report.py -->", "<!-- /measured -->"
COMMAND = (
    "python -m pytest benchmarks --benchmark-json=benchmarks/results/last.json && "
    "python benchmarks/report.py benchmarks/results/last.json"
)
FORMS = {"line": "on a line", "plane": "in the plane", "polar": "polar form", "impact": "time of impact"}
COLLISIONS = ("line", "plane", "polar")
# Name in the data: name in the table, name in the pictures, colour, marker.
CONTESTANTS = {
    "bytes only": ("the memory limit: the same bytes, nothing computed", "the memory limit", "#8b949e", ""),
    "collide": ("collide", "collide", "#e5534b", "o"),
    "prange": ("Numba prange (polar: libm)", "Numba prange", "#4493f8", "s"),
    "prange, same formula": ("Numba prange, collide's own formula", "prange, collide's formula", "#1f9e89", "D"),
    "C": ("C: cc -O3 -march=native -fopenmp", "C with OpenMP", "#b083f0", "^"),
    "Taichi": ("Taichi", "Taichi", "#d4a72c", "v"),
    "numexpr": ("numexpr", "numexpr", "#57ab5a", "P"),
    "JAX": ("JAX", "JAX", "#e275ad", "X"),
    "NumPy": ("NumPy", "NumPy", "#f0883e", "*"),
    "pymunk": ("pymunk, one step of an engine", "pymunk, one step", "#a5734f", "h"),
}
LARGE = 10_000_000


class Entry(NamedTuple):
    """One contestant in one case: its pairs a second, and how many times as fast as it collide is."""

    rate: float
    ratio: float


Key = tuple[str, int, int, str]  # form, pairs, threads, contestant


def entries(data: dict[str, Any]) -> dict[Key, Entry]:
    batches = [b for b in data["benchmarks"] if "contestant" in b["extra_info"]]
    own: dict[Any, float] = {}
    for b in batches:
        info = b["extra_info"]
        if info["contestant"] == "collide":
            own[info["form"], info["n"], info["threads"]] = info["n"] / b["stats"]["median"]
    found = {}
    for b in batches:
        info = b["extra_info"]
        case = info["form"], info["n"], info["threads"]
        ratio = 1.0 if info["contestant"] == "collide" else 1 / info["as fast as the reference"]
        found[(*case, info["contestant"])] = Entry(own[case] / ratio, ratio)
    return found


def number(x: float) -> str:
    """Three figures at most, and no exponent."""
    return f"{x:.0f}" if x >= 100 else f"{x:.1f}" if x >= 10 else f"{x:.2f}"


def section(data: dict[str, Any]) -> str:
    """What stands between the README's markers."""
    machine, found = data["machine_info"], entries(data)
    threads = machine["collide threads"]
    lines = [
        f"{LARGE:,} pairs, float64, {threads} threads, million pairs a second, and how many times as fast collide is:",
        "",
        "| | " + " | ".join(FORMS.values()) + " |",
        "|---|" + "---|" * len(FORMS),
    ]
    for name, (label, *_) in CONTESTANTS.items():
        row = [found.get((form, LARGE, threads, name)) for form in FORMS]
        if any(row):
            bold = "**" if name == "collide" else ""
            cells = []
            for entry in row:
                rate = f"{bold}{number(entry.rate / 1e6)}{bold}" if entry else ""
                cells.append(f"{rate} ({number(entry.ratio)}x)" if entry and name != "collide" else rate)
            lines.append(f"| {bold}{label}{bold} | " + " | ".join(cells) + " |")
    lines += [
        "",
        *wrapped(
            "Times of impact by prange and NumPy are those of the textbook's discriminant, which loses half of the "
            "digits near a graze."
        ),
        "",
        "![Pairs a second against the size of the batch](benchmarks/results/sizes.svg)",
        "",
        f"![Pairs a second for {LARGE:,} pairs](benchmarks/results/bars.svg)",
        "",
        *wrapped(f"Options, relative to float64 arrays with `out` given, for a million pairs: {options(data)}."),
        "",
        *wrapped(f"One pair, in arrays of length 1: {latencies(found, threads)}. {start(data)}"),
        "",
        *simulation(data),
        *files(data),
        *wrapped("Where it loses: " + losses(found) + "."),
        "",
        *wrapped(
            f"{machine['cpu']['brand_raw']}, {threads} threads; Python {machine['python_version']}, "
            f"NumPy {machine['numpy']}, Numba {machine['numba']}; {data['datetime'][:10]}; OMP_WAIT_POLICY="
            f"{machine['OMP_WAIT_POLICY']}; medians of rounds interleaved with collide's. All of it, this text and the "
            f"pictures included, by `{COMMAND}`"
        ),
    ]
    return "\n".join(lines)


def options(data: dict[str, Any]) -> str:
    parts = []
    variants = [b["extra_info"] for b in data["benchmarks"] if b["extra_info"].get("variant")]
    for name in dict.fromkeys(v["variant"] for v in variants):
        of = {
            v["form"]: v["as fast as the reference"] for v in variants if v["variant"] == name and v["n"] == 1_000_000
        }
        parts.append(f"{name.replace('_', ' ')} {' / '.join(f'{of[form]:.2f}' for form in COLLISIONS)}")
    return "; ".join(parts) + f" ({' / '.join(FORMS[form] for form in COLLISIONS)})"


def latencies(found: dict[Key, Entry], threads: int) -> str:
    parts = []
    for form in COLLISIONS:
        own, other = (found[form, 1, threads, name] for name in ("collide", "NumPy"))
        parts.append(f"{FORMS[form]} {1e6 / own.rate:.1f} us, NumPy's expression {1e6 / other.rate:.1f}")
    return "; ".join(parts)


def start(data: dict[str, Any]) -> str:
    infos = [b["extra_info"] for b in data["benchmarks"] if "start" in b["extra_info"]]
    seconds = {info["start"]: info["seconds"] for info in infos}
    both, numba, trivial = (seconds[name] for name in ("import numba and collide", "import numba", "trivial, cached"))
    cached, compiling = seconds["collide, cached"], seconds["collide, compiling"]
    return (
        f"`import collide` takes {both - numba:.2f} s beyond Numba's {numba:.2f}; the first call of a process "
        f"{cached:.2f} s (that of a trivial function of Numba's {trivial:.2f}), or {compiling:.1f} s where it has to "
        "be compiled."
    )


def simulation(data: dict[str, Any]) -> list[str]:
    """What the benchmarks of a ball state found; nothing of what did not run."""
    infos = [b["extra_info"] for b in data["benchmarks"]]
    ratios = {
        (i["rival"], i["search"], i["space"]): number(1 / i["as fast as the reference"]) for i in infos if "search" in i
    }
    lines = []
    if ratios:
        sizes, spaces = (list(dict.fromkeys(key[k] for key in ratios)) for k in (1, 2))
        lines += [
            *wrapped(
                f"How many times as fast as others find_contacts is, {' / '.join(spaces)}, by the number of disks:"
            ),
            "",
            "| | " + " | ".join(f"{n:,}" for n in sizes) + " |",
            "|---|" + "---|" * len(sizes),
        ]
        for rival in dict.fromkeys(key[0] for key in ratios):
            cells = (" / ".join(ratios.get((rival, n, space), "-") for space in spaces) for n in sizes)
            lines.append(f"| {rival} | " + " | ".join(cells) + " |")
        lines.append("")
    rates = ", ".join(f"{number(i['rate'])} million in {i['resolve']}" for i in infos if "resolve" in i)
    steps = ", ".join(
        f"{i['rival']} {number(1 / i['as fast as the reference'])} times as long" for i in infos if "step" in i
    )
    sentences = [f"resolve_contacts takes of a million disks, in pairs a second: {rates}."] if rates else []
    if steps:
        sentences.append(f"A step of a gas of 10,000 disks takes {steps}.")
    return [*lines, *wrapped(" ".join(sentences)), ""] if sentences else lines


def files(data: dict[str, Any]) -> list[str]:
    """What the benchmarks of files and of a cluster found."""
    infos = [b["extra_info"] for b in data["benchmarks"]]
    copied = "; ".join(
        f"{i['file']}: {number(i['rate'])} million pairs a second, {number(i['copies'])} times as fast"
        for i in infos
        if "file" in i
    )
    shared = "; ".join(
        f"{number(i['as fast as the reference'])} times the rate of {i['cluster']}" for i in infos if "cluster" in i
    )
    lines = (
        wrapped(f"`collide resolve`, beside a plain copy of as many bytes, both synced to disk: {copied}.")
        if copied
        else []
    )
    lines += wrapped(f"Dask, from disk to disk on 2 processes of 1 thread: {shared}.") if shared else []
    return [*lines, ""] if lines else []


def losses(found: dict[Key, Entry]) -> str:
    """Every case in which another contestant is faster by more than the noise of a twentieth."""
    cases: dict[str, list[str]] = {}
    for (form, n, threads, name), entry in found.items():
        if name not in ("collide", "bytes only") and entry.ratio < 0.95:
            case = f"{n:,} pair{'s' * (n > 1)} {FORMS[form]}{' on 1 thread' * (threads == 1)}"
            cases.setdefault(case, []).append(f"{name} {entry.ratio:.2f}")
    return "; ".join(f"{case}: {', '.join(sorted(names))}" for case, names in cases.items()) or "nowhere in this run"


def wrapped(text: str, width: int = 120) -> list[str]:
    import textwrap

    return textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False)


def rewrite(readme: str, text: str) -> str:
    head, _, rest = readme.partition(BEGIN)
    _, _, tail = rest.partition(END)
    if not tail:
        raise SystemExit(f"README.md has no {BEGIN} ... {END}")
    return f"{head}{BEGIN}\n{text}\n{END}{tail}"


# Pictures on no background of their own, in greys and hues that a white page and a black one both show.
INK = "#7d8590"


def style() -> Any:
    import matplotlib

    matplotlib.use("svg")
    inked = ("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color")
    matplotlib.rcParams.update(dict.fromkeys(inked, INK))
    matplotlib.rcParams.update({"savefig.transparent": True, "legend.frameon": False, "font.size": 9})
    matplotlib.rcParams.update({"axes.spines.top": False, "axes.spines.right": False})
    matplotlib.rcParams.update({"svg.hashsalt": "collide", "svg.fonttype": "path"})  # the same file every time
    from matplotlib import pyplot

    return pyplot


def draw_sizes(found: dict[Key, Entry], threads: int, path: Path) -> None:
    plt = style()
    figure, axes = plt.subplots(1, 2, figsize=(9, 4.4), sharey=True)
    for ax, form in zip(axes, ("plane", "polar"), strict=True):
        for name, (_, label, colour, marker) in CONTESTANTS.items():
            points = sorted((n, e.rate) for (f, n, t, c), e in found.items() if (f, t, c) == (form, threads, name))
            if name == "bytes only":
                ax.axhline(points[-1][1], color=colour, linestyle="--", label=label)
            elif points:
                wide = {"linewidth": 2.5, "zorder": 3} if name == "collide" else {"linewidth": 1.2}
                ax.loglog(*zip(*points, strict=True), color=colour, marker=marker, markersize=4, label=label, **wide)
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.set_title(FORMS[form], fontsize=10)
        ax.set_xlabel("pairs in a batch")
        ax.grid(color=INK, alpha=0.2)
    axes[0].set_ylabel("pairs a second")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=3, fontsize=8)
    figure.tight_layout(rect=(0, 0.2, 1, 1))
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def draw_bars(found: dict[Key, Entry], threads: int, path: Path) -> None:
    plt = style()
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True)
    shown = ("plane", "polar")
    names = [name for name in CONTESTANTS if any((form, LARGE, threads, name) in found for form in shown)]
    for ax, form in zip(axes, shown, strict=True):
        limit = found[form, LARGE, threads, "bytes only"].rate / 1e6
        ax.axvline(limit, color=INK, linestyle="--", linewidth=1)
        for i, name in enumerate(names):
            entry = found.get((form, LARGE, threads, name))
            if entry:
                rate = entry.rate / 1e6
                ax.barh(i, rate, color=CONTESTANTS[name][2], height=0.7)
                inside = rate > limit / 2
                place, side = (rate - limit / 50, "right") if inside else (rate + limit / 50, "left")
                ax.text(place, i, number(rate), va="center", ha=side, fontsize=8, color="black" if inside else INK)
        ax.set_title(FORMS[form], fontsize=10)
        ax.set_xlabel(f"million pairs a second, {LARGE:,} pairs")
        ax.set_xlim(0, limit * 1.1)
    axes[0].set_yticks(range(len(names)), [CONTESTANTS[name][1] for name in names])
    axes[0].invert_yaxis()
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def main(path: str) -> None:
    data = json.loads(Path(path).read_text())
    found, threads = entries(data), data["machine_info"]["collide threads"]
    readme = ROOT / "README.md"
    readme.write_text(rewrite(readme.read_text(), section(data)))
    RESULTS.mkdir(exist_ok=True)
    draw_sizes(found, threads, RESULTS / "sizes.svg")
    draw_bars(found, threads, RESULTS / "bars.svg")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(sys.argv[1])
