"""Images of synthetic people on a known floor, with all that is known about them (`ipman data render`)."""
