"""The ablation of fitting with and without intuitive physics, on people whose bodies the fitter does not have.

people    bodies outside the fitter's shape space        scenes    those bodies at rest on the floor, tipped, in the air
settings  the observations that a fit gets                     rows      what is compared
run       fits, measured and kept in a folder            report    the tables
"""
