"""Small files of every data set, written from its description."""
