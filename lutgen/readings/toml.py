"""A campaign file (TOML) as a table of readings: all its sessions, by operating hours."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lutgen.readings.campaign import parse_campaign

if TYPE_CHECKING:
    from lutgen.readings.table import Measurements


def read(text: str, *, file: str, sha256: str) -> Measurements:  # noqa: ARG001 - the campaign's hash covers its sessions too
    """Read campaign ``text``; errors as :func:`lutgen.readings.campaign.read_campaign`."""
    return parse_campaign(text, file=file).measurements()
