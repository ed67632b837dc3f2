"""What the system says: of its errors, and of itself."""

from __future__ import annotations

import os
import platform
import sys

if sys.platform == "win32":
    import ctypes

    def reason(error: OSError) -> str:
        """What is wrong, and of which file not. The system's own number says more than that of C."""
        own: int | None = getattr(error, "winerror", None)
        if own:
            return ctypes.FormatError(own)
        return os.strerror(error.errno) if error.errno else str(error)

else:

    def reason(error: OSError) -> str:
        """What is wrong, and of which file not."""
        return os.strerror(error.errno) if error.errno else str(error)


def system() -> str:
    """Which it is, on what kind of processor."""
    return f"{platform.system()} on {platform.machine()}"
