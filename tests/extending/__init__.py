"""The pages of docs/extending, carried out."""
