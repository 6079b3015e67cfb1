"""Processes that tests start and interrupt."""

import signal


def hears_interrupts():
    """Let a process hear interrupts, which are ignored where tests run in the background."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
