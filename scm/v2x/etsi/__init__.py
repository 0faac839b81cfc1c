"""ETSI messages: records in the units of the standards, and conversion from and to our own."""
