"""The two pictures of the README: pairs a second against the size of the batch, and for a large one.

On no background of their own, in greys and hues that a white page and a black one both show.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from saved import CONTESTANTS, FORMS, LARGE, Entry, Key, number

INK = "#7d8590"


def style() -> Any:
    import matplotlib

    matplotlib.use("svg")
    inked: Any = ("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color")
    matplotlib.rcParams.update(dict.fromkeys(inked, INK))
    matplotlib.rcParams.update({"savefig.transparent": True, "legend.frameon": False, "font.size": 9})
    matplotlib.rcParams.update({"axes.spines.top": False, "axes.spines.right": False})
    matplotlib.rcParams.update({"svg.hashsalt": "collide", "svg.fonttype": "path"})  # the same file every time
    from matplotlib import pyplot

    return pyplot


def draw_sizes(found: dict[Key, Entry], threads: int, path: Path) -> None:
    plt = style()
    figure, axes = plt.subplots(1, 2, figsize=(9, 4.4), sharey=True)
    for ax, form in zip(axes, ("2d", "polar"), strict=True):
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
    shown = ("2d", "polar")
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
