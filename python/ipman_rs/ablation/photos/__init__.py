"""Fits of real photos, judged by what a person sees in them."""
