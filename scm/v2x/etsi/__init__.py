"""ETSI messages: their records in the units of the standards, and the way from and to ours."""
