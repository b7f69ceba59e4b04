"""`ipman train`: a configuration, its data and a Lightning module. Needs the extra `train`."""
