"""What the system says of its errors."""

from __future__ import annotations

import os
import sys

if sys.platform == "win32":
    import ctypes

    def reason(error: OSError) -> str:
        """What is wrong, and of which file not; its own number says more than the one that it has in C."""
        if error.winerror:
            return ctypes.FormatError(error.winerror)
        return os.strerror(error.errno) if error.errno else str(error)

else:

    def reason(error: OSError) -> str:
        """What is wrong, and of which file not."""
        return os.strerror(error.errno) if error.errno else str(error)
