"""Results from sessions of readings without a model: one session, two sessions, and a display's history.

``inspect`` summarises one session. ``explain`` says why two sessions differ; ``causes`` holds one file for each cause.
``trend`` says how a display changes over its sessions. A further file in this folder answers another question about
sessions: it takes a :class:`~lutgen.readings.session.Session` or a pair of sessions, and returns a frozen result, or
None if patches are missing.
"""

from lutgen.history.inspect import Inspection, inspect_session

__all__ = ["Inspection", "inspect_session"]
