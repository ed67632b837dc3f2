"""How the pictures of the examples look."""

from __future__ import annotations

from typing import Any

import numpy as np

# Colours that everybody can tell apart (Okabe and Ito): what is measured, theory, a second measurement; and the rest.
BLUE, RED, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "0.6"
STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.linewidth": 0.8,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "savefig.dpi": 200,
    **{f"{axis}tick.{what}": value for axis in "xy" for what, value in (("direction", "in"), ("labelsize", 8.5))},
}


def panels(*widths: float, height: float) -> tuple[Any, list[Any]]:
    """A figure and its panels side by side, of these widths in inches."""
    from matplotlib import pyplot as plt

    plt.rcParams.update(STYLE)
    figure, axes = plt.subplots(
        1, len(widths), figsize=(sum(widths), height), width_ratios=widths, layout="compressed", squeeze=False
    )
    return figure, list(axes[0])


def draw_disks(ax: Any, position: Any, radius: Any, **colours: Any) -> Any:
    """Disks to scale."""
    from matplotlib.collections import EllipseCollection

    size = 2 * radius
    disks = EllipseCollection(size, size, 0, units="xy", offsets=position.T, offset_transform=ax.transData, **colours)
    ax.set(xticks=[], yticks=[], aspect="equal")
    return ax.add_collection(disks)


def draw_speeds(ax: Any, speed: Any, maxwell: Any, at_first: float, **options: Any) -> None:
    """How speeds are distributed, beside Maxwell's density as a function of the speed."""
    end = 2.5 * at_first
    s = np.linspace(0.0, end, 300)
    ax.hist(speed, bins=60, range=(0.0, end), density=True, color=BLUE, alpha=0.35, label="measured")
    ax.plot(s, maxwell(s), color=RED, label="Maxwell")
    ax.axvline(at_first, color=GREY, linestyle=":", label="at first")
    ax.set(xlim=(0.0, end), ylim=(0.0, None), ylabel="probability density", **options)
    ax.legend()


def save(figure: Any, file: str | None) -> None:
    """To a file, or onto the screen."""
    from matplotlib import pyplot as plt

    if file:
        figure.savefig(file)
    else:
        plt.show()
    plt.close(figure)
