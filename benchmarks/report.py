"""From pytest-benchmark's JSON to the tables of two READMEs, in place between their markers, and to two pictures.

    python -m pytest benchmarks --benchmark-json=benchmarks/results/last.json
    python benchmarks/report.py benchmarks/results/last.json

README.md gets one table, benchmarks/README.md all. What was not measured is left out. What is written as a rate is made
of ratios: see saved.py.
"""

from __future__ import annotations

import json
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pictures import draw_bars, draw_sizes
from saved import COLLISIONS, CONTESTANTS, FORMS, LARGE, Entry, Key, counted, duels, entries, number

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results"
BEGIN, END = "<!-- measured: written by benchmarks/report.py -->", "<!-- /measured -->"
STARTS = {
    "import numba": "import numba",
    "import numba and collide": "import numba and collide",
    "trivial, cached": "the first call of a trivial function of Numba's, kept on disk",
    "collide, cached": "the first call of resolve_2d, kept on disk",
    "collide, compiling": "the first call of resolve_2d, which is compiled",
}
Data = dict[str, Any]
Lines = list[str]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Lines:
    def line(cells: Sequence[str]) -> str:
        return "|" + "|".join(f" {cell} " if cell else " " for cell in cells) + "|"

    return [line(head), "|" + "---|" * len(head), *map(line, rows), ""]


def wrapped(text: str, width: int = 120) -> Lines:
    return [*textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False), ""]


def time(seconds: float) -> str:
    return f"{number(1e6 * seconds)} us" if seconds < 1e-3 else f"{number(1e3 * seconds)} ms"


def infos(data: Data, key: str) -> list[Data]:
    """What the benchmarks left that state this."""
    return [
        b["extra_info"] | b["stats"] | {"group": b.get("group")} for b in data["benchmarks"] if key in b["extra_info"]
    ]


def pivot(first: str, cells: Mapping[tuple[str, int], str], what: str = "disk") -> Lines:
    """A table of cells that are known by a name and a number of things."""
    names, sizes = dict.fromkeys(name for name, _ in cells), dict.fromkeys(n for _, n in cells)
    rows = ([name, *(cells.get((name, n), "") for n in sizes)] for name in names)
    return table([first, *(counted(n, what) for n in sizes)], rows)


def ratio(info: Data) -> str:
    """How many times as long as collide the rival took."""
    return number(1 / info["as fast as the reference"])


def machine(data: Data) -> str:
    found = data["machine_info"]
    return (
        f"{found['cpu']['brand_raw']}, {found['collide threads']} threads; Python {found['python_version']}, "
        f"NumPy {found['numpy']}, Numba {found['numba']}; {data['datetime'][:10]}"
    )


def summary(data: Data) -> Lines:
    """What stands in README.md: the calls of eight lines, and one picture."""
    found, threads = entries(data), data["machine_info"]["collide threads"]
    rows = []
    made = {(i["way"], i["n"], i["by"]): i for i in infos(data, "way")}
    for way, n, what in (
        ("columns", 1, "columns"),
        ("columns", 10_000, "columns"),
        ("rows", 1_000_000, "rows"),
    ):
        if (way, n, "collide") in made:
            took = made[way, n, "collide"]["median"]
            others = (ratio(made[way, n, by]) for by in ("NumPy", "prange"))
            rows.append([f"{counted(n)}, in the plane, {what}", time(took), number(n / took / 1e6), *others, ""])
    for form in ("1d", "2d", "3d", "polar", "impact"):
        if own := found.get((form, LARGE, threads, "collide")):
            entries_of = (found.get((form, LARGE, threads, name)) for name in ("NumPy", "prange", "bytes only"))
            cells = [number(entry.ratio) if entry else "" for entry in entries_of]
            what = f"{counted(LARGE)}, {FORMS[form]}"
            rows.append([what, time(LARGE / own.rate), number(own.rate / 1e6), *cells])
    head = ["", "a call takes", "million pairs/s", "NumPy's expression", "a loop of Numba's prange", "the memory limit"]
    searches = {(i["rival"], i["search"], i["space"]): ratio(i) for i in infos(data, "search")}
    lines = [
        *wrapped(
            "The last three columns are the time of others divided by collide's; below 1 the other is faster. NumPy "
            "has one thread, the others as many. The memory limit is a kernel that only moves the same bytes."
        ),
        *table(head, rows),
    ]
    scipy = [r for (rival, n, space), r in searches.items() if (n, space) == (1_000_000, "open") and "SciPy" in rival]
    contacts = "".join(
        f"SciPy's cKDTree takes {r} times as long to find the contacts of a million disks. " for r in scipy
    )
    return [
        *lines,
        "![Others' speed relative to collide's, against the number of pairs](benchmarks/results/sizes.svg)",
        "",
        *wrapped(f"{contacts}Medians of interleaved rounds; {machine(data)}."),
    ]


def measurements(data: Data) -> Lines:
    """What stands in benchmarks/README.md."""
    found, threads = entries(data), data["machine_info"]["collide threads"]
    return [
        *wrapped(
            f"{machine(data)}; OMP_WAIT_POLICY={data['machine_info']['OMP_WAIT_POLICY']}. Medians of rounds that are "
            "interleaved with collide's. Where it says how many times as long others take, they are faster below 1."
        ),
        *large(found, threads),
        *calls(data),
        *small(found, threads),
        *options(data),
        *simulation(data),
        *files(data),
        *start(data),
        *losses(data),
    ]


def large(found: dict[Key, Entry], threads: int) -> Lines:
    """Batches far beyond the caches, by form and contestant: rates, and what they are of collide's."""
    forms = [form for form in FORMS if (form, LARGE, threads, "collide") in found]
    if not forms:
        return []
    rates, times = [], []
    for name, (label, *_) in CONTESTANTS.items():
        row = [found.get((form, LARGE, threads, name)) for form in forms]
        if any(row):
            rates.append([label, *(number(entry.rate / 1e6) if entry else "" for entry in row)])
            times.append([label, *(number(entry.ratio) if entry else "" for entry in row)])
    head = ["", *(FORMS[form] for form in forms)]
    return [
        f"### Batches of {counted(LARGE)}",
        "",
        f"Million pairs a second, float64, {threads} threads:",
        "",
        *table(head, rates),
        "How many times as long as collide each takes:",
        "",
        *table(head, (row for row in times if row[0] != "collide")),
        *wrapped(
            "Times of impact by others are those of the textbook's discriminant, which loses half of the digits near a "
            "graze."
        ),
        "![Pairs a second of large batches](results/bars.svg)",
        "",
        "The dashed lines are the memory limit.",
        "",
        "![Others' speed relative to collide's, against the number of pairs](results/sizes.svg)",
        "",
    ]


def calls(data: Data) -> Lines:
    """The calls that people make."""
    made = infos(data, "way")
    if not made:
        return []
    sizes, ways = (list(dict.fromkeys(i[key] for i in made)) for key in ("n", "way"))
    head = ["", *map(counted, sizes)]
    by = {(i["way"], i["n"], i["by"]): i for i in made}
    lines = [
        "### The calls that people make",
        "",
        "What a call takes, of pairs in the plane, or as rows of three in space:",
        "",
    ]
    lines += table(head, ([way, *(time(by[way, n, "collide"]["median"]) for n in sizes)] for way in ways))
    for rival, what in (
        ("prange", "a loop of Numba's prange that its user would write over the same arrays"),
        ("NumPy", "NumPy's expression"),
    ):
        lines += [f"How many times as long {what} takes:", ""]
        lines += table(head, ([way, *(ratio(by[way, n, rival]) for n in sizes)] for way in ways))
    return lines


def small(found: dict[Key, Entry], threads: int) -> Lines:
    rows = []
    for form in FORMS:
        own, other = (found.get((form, 1, threads, name)) for name in ("collide", "NumPy"))
        if own and other:
            rows.append([FORMS[form], f"{1e6 / own.rate:.1f} us", f"{1e6 / other.rate:.1f} us"])
    return (
        ["### One pair, in arrays of length 1", "", *table(["", "collide", "NumPy's expression"], rows)] if rows else []
    )


def options(data: Data) -> Lines:
    variants = infos(data, "variant")
    forms = [form for form in COLLISIONS if any(v["form"] == form for v in variants)]
    sizes = list(dict.fromkeys(v["n"] for v in variants))
    lines: Lines = []
    for n in sizes:
        of = {(v["variant"], v["form"]): f"{v['as fast as the reference']:.2f}" for v in variants if v["n"] == n}
        names = dict.fromkeys(name for name, _ in of)
        lines += [f"Speed of {counted(n)}, relative to float64 columns with `out` given:", ""]
        rows = ([name.replace("_", " "), *(of.get((name, form), "") for form in forms)] for name in names)
        lines += table(["", *(FORMS[form] for form in forms)], rows)
    return ["### Options, dtypes and layouts", "", *lines] if lines else []


def simulation(data: Data) -> Lines:
    """Ball states."""
    lines: Lines = []
    if searches := {(f"{i['rival']}, {i['space']}", i["search"]): ratio(i) for i in infos(data, "search")}:
        lines += ["How many times as long as find_contacts others take:", "", *pivot("", searches)]
    # Which layout it was stands in the name of the group.
    if walls := {(f"{i['rival']}, {i['group'].split(', ')[-1]}", i["walls"]): ratio(i) for i in infos(data, "walls")}:
        lines += ["How many times as long as resolve_walls others take:", "", *pivot("", walls)]
    rows = [
        [f"500,000 pairs of a million balls in {i['drawn']}, by NumPy's indexing", ratio(i)]
        for i in infos(data, "drawn")
    ]
    rows += [[f"{i['step']}, by {i['rival']}", ratio(i)] for i in infos(data, "step")]
    if rows:
        lines += ["How many times as long as collide others take for other parts of a simulation:", ""]
        lines += table(["", ""], rows)
    if resolved := infos(data, "resolve"):
        lines += ["Million contacts a second of resolve_contacts, of a million disks:", ""]
        lines += table(["", ""], ([i["resolve"], number(i["rate"])] for i in resolved))
    return ["### Simulations", "", *lines] if lines else []


def files(data: Data) -> Lines:
    lines: Lines = []
    if resolved := infos(data, "file"):
        lines += ["`collide resolve`, all synced to disk, and how many times as long others take:", ""]
        # Of these the reference is the rival.
        rows = (
            [i["file"], number(i["rate"]), f"{i['rival']}: {number(i['as fast as the reference'])}"] for i in resolved
        )
        lines += table(["", "million pairs a second", "others"], rows)
    if shared := infos(data, "cluster"):
        lines += ["Dask from disk to disk, 2 processes of 1 thread: the rate, relative to others:", ""]
        lines += table(["", ""], ([i["cluster"], number(i["as fast as the reference"])] for i in shared))
    return ["### Files and clusters", "", *lines] if lines else []


def start(data: Data) -> Lines:
    rows = [[STARTS[i["start"]], f"{i['seconds']:.2f} s"] for i in infos(data, "start")]
    return ["### Start of a process", "", *table(["", ""], rows)] if rows else []


def losses(data: Data) -> Lines:
    """Every case in which another contestant is faster by more than the noise of a twentieth."""
    rows = [[duel.case, duel.rival, f"{duel.ratio:.2f}"] for duel in duels(data) if duel.ratio < 0.95]
    lines = table(["", "who", "takes, of collide's time"], rows) if rows else ["Nowhere in this run.", ""]
    return ["### Where others are faster", "", *lines]


def rewrite(path: Path, lines: Lines) -> None:
    """The text between the markers of a file; nothing else is touched."""
    text = path.read_text()
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    if not tail:
        raise SystemExit(f"{path}: has no {BEGIN} ... {END}")
    path.write_text("\n".join([head + BEGIN, *lines[:-1], END + tail]))


def main(path: str) -> None:
    data = json.loads(Path(path).read_text())
    found, threads = entries(data), data["machine_info"]["collide threads"]
    rewrite(ROOT / "README.md", summary(data))
    rewrite(ROOT / "benchmarks" / "README.md", measurements(data))
    RESULTS.mkdir(exist_ok=True)
    draw_sizes(found, threads, RESULTS / "sizes.svg")
    draw_bars(found, threads, RESULTS / "bars.svg")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    main(sys.argv[1])
