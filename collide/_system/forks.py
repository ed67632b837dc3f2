"""What is to happen where a process forks; nothing where there are no forks."""

from __future__ import annotations

import os

# Takes before=, after_in_parent= and after_in_child=.
at_fork = getattr(os, "register_at_fork", lambda **handlers: None)
