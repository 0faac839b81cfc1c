"""The real Nigel: rosserial over a cable, its driver, and its telemetry."""
