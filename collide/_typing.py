"""What signatures throughout the package say of arrays, numbers and options."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Number = float | np.floating[Any] | np.integer[Any] | np.bool_
Invalid = Literal["raise", "keep", "nan"]
InvalidTime = Literal["raise", "nan"]  # of a time of impact, which has nothing to keep
