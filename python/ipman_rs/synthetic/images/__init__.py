"""Images of synthetic people on a known floor, with their labels (`ipman data render`)."""
