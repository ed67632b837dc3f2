"""From pytest-benchmark's JSON to the README's table, in place between its markers, and to two pictures.

    python -m pytest benchmarks --benchmark-json=benchmarks/results/last.json
    python benchmarks/report.py benchmarks/results/last.json

What is written as a rate is made of ratios: see saved.py.
"""

from __future__ import annotations

import json
import sys
import textwrap
from pathlib import Path
from typing import Any

from pictures import draw_bars, draw_sizes
from saved import COLLISIONS, CONTESTANTS, FORMS, LARGE, Entry, Key, entries, number

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results"
BEGIN, END = "<!-- measured: written by benchmarks/report.py -->", "<!-- /measured -->"
COMMAND = (
    "python -m pytest benchmarks --benchmark-json=benchmarks/results/last.json && "
    "python benchmarks/report.py benchmarks/results/last.json"
)


def section(data: dict[str, Any]) -> str:
    """What stands between the README's markers."""
    machine, found = data["machine_info"], entries(data)
    threads = machine["collide threads"]
    forms = [form for form in FORMS if (form, LARGE, threads, "collide") in found]
    lines = [
        *calls(data),
        f"{LARGE:,} pairs, float64, {threads} threads, million pairs a second, and how many times as fast collide is:",
        "",
        "| | " + " | ".join(FORMS[form] for form in forms) + " |",
        "|---|" + "---|" * len(forms),
    ]
    for name, (label, *_) in CONTESTANTS.items():
        row = [found.get((form, LARGE, threads, name)) for form in forms]
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


def calls(data: dict[str, Any]) -> list[str]:
    """The table of the calls that people make; nothing where they were not timed."""
    infos = [b["extra_info"] | b["stats"] for b in data["benchmarks"] if "way" in b["extra_info"]]
    if not infos:
        return []
    sizes, ways = (list(dict.fromkeys(i[key] for i in infos)) for key in ("n", "way"))
    ratio = {(i["way"], i["n"], i["by"]): number(1 / i["as fast as the reference"]) for i in infos}
    space = " and, as rows of three, in space" * any("three" in way for way in ways)
    took = {(i["way"], i["n"]): i["median"] for i in infos if i["by"] == "collide"}
    lines = [
        *wrapped(
            f"The calls that people make, of pairs in the plane{space}: what one takes, and how many times as fast it "
            "is as a loop of Numba's prange that its user would write over the same arrays, and as NumPy's expression:"
        ),
        "",
        "| | " + " | ".join(f"{n:,} pair{'s' * (n > 1)}" for n in sizes) + " |",
        "|---|" + "---|" * len(sizes),
    ]
    for way in ways:
        cells = (f"{time(took[way, n])}: {ratio[way, n, 'prange']}, {ratio[way, n, 'NumPy']}" for n in sizes)
        lines.append(f"| {way} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def time(seconds: float) -> str:
    return f"{number(1e6 * seconds)} us" if seconds < 1e-3 else f"{number(1e3 * seconds)} ms"


def options(data: dict[str, Any]) -> str:
    parts = []
    variants = [b["extra_info"] for b in data["benchmarks"] if b["extra_info"].get("variant")]
    forms = [form for form in COLLISIONS if any(v["form"] == form for v in variants)]
    for name in dict.fromkeys(v["variant"] for v in variants):
        of = {
            v["form"]: v["as fast as the reference"] for v in variants if v["variant"] == name and v["n"] == 1_000_000
        }
        parts.append(f"{name.replace('_', ' ')} {' / '.join(f'{of[form]:.2f}' for form in forms)}")
    return "; ".join(parts) + f" ({' / '.join(FORMS[form] for form in forms)})"


def latencies(found: dict[Key, Entry], threads: int) -> str:
    parts = []
    for form in COLLISIONS:
        own, other = (found.get((form, 1, threads, name)) for name in ("collide", "NumPy"))
        if own and other:
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
    drawn = ", ".join(f"{number(1 / i['as fast as the reference'])} for {i['drawn']}" for i in infos if "drawn" in i)
    sentences = [f"resolve_contacts takes of a million disks, in pairs a second: {rates}."] if rates else []
    if drawn:
        sentences.append(
            "resolve_pairs is, for 500,000 pairs of a million balls, so many times as fast as NumPy's indexing and a "
            f"batch: {drawn}."
        )
    if steps:
        sentences.append(f"A step of a gas of 10,000 disks takes {steps}.")
    return [*lines, *wrapped(" ".join(sentences)), ""] if sentences else lines


def files(data: dict[str, Any]) -> list[str]:
    """What the benchmarks of files and of a cluster found."""
    infos = [b["extra_info"] for b in data["benchmarks"]]
    rates: dict[str, list[str]] = {}
    for i in infos:
        if "file" in i:
            sentence = rates.setdefault(i["file"], [f"{number(i['rate'])} million pairs a second"])
            sentence.append(f"{number(i['as fast as the reference'])} times as fast as {i['rival']}")
    resolved = "; ".join(f"{file}: {', '.join(sentence)}" for file, sentence in rates.items())
    shared = "; ".join(
        f"{number(i['as fast as the reference'])} times the rate of {i['cluster']}" for i in infos if "cluster" in i
    )
    lines = wrapped(f"`collide resolve`, all synced to disk: {resolved}.") if resolved else []
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
    return textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False)


def rewrite(readme: str, text: str) -> str:
    head, _, rest = readme.partition(BEGIN)
    _, _, tail = rest.partition(END)
    if not tail:
        raise SystemExit(f"README.md has no {BEGIN} ... {END}")
    return f"{head}{BEGIN}\n{text}\n{END}{tail}"


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
