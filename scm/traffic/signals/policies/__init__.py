"""Policies: one file is one policy, found by its name, asked for with a `SignalRequest`.

A file holds `POLICY = Policy(about, start, step)`; `docs/signals.md` shows how to write one.
"""
