"""The real Nigel: rosserial over a cable, the driver of it, and what the firmware tells."""
