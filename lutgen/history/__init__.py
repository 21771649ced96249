"""What sessions of readings say of a display without a model: one session, two sessions, and a display's history.

``inspect`` puts together what one session says, ``explain`` why two sessions differ (``causes`` holds one file a
cause), ``trend`` how a display changes over its sessions. One more file here answers one more question about sessions:
it takes a :class:`~lutgen.readings.session.Session` or a pair, and gives a frozen result, or None where patches are
missing.
"""

from __future__ import annotations

from lutgen.history.inspect import Inspection, inspect_session

__all__ = ["Inspection", "inspect_session"]
