"""What a session of readings says of a display, before any model: one idea a module, put together by ``inspect``.

Each module takes a :class:`~lutgen.readings.session.Session` and gives a frozen result, or None where the session
lacks the patches for it; ``wanting`` says which, and for what they are needed.
"""

from __future__ import annotations

from lutgen.history.inspect import Inspection, inspect_session

__all__ = ["Inspection", "inspect_session"]
