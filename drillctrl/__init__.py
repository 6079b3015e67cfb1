"""Control design for rotary drill strings with state-dependent delay."""

from __future__ import annotations
