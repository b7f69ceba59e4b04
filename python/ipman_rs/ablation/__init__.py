"""Ablations: what the terms of intuitive physics change in fitting (`fitting`) and in training (`training`)."""
