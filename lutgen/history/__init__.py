"""Results from sessions of readings without a model: one session, two sessions, and a display's history.

``inspect`` summarises one session, ``explain`` says why two sessions differ, and ``trend`` how a display changes. A
further file takes a :class:`~lutgen.readings.session.Session` or a pair of sessions, and returns a frozen result, or
None if patches are missing.
"""

from lutgen.history.inspect import Inspection, inspect_session

__all__ = ["Inspection", "inspect_session"]
