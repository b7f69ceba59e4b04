"""The ablation of IPMAN-R: regressors trained with and without intuitive physics on static people whose truth is known.

rows      what is compared, with settings frozen in settings.yaml      run      training and estimates, kept in a folder
measure   figures of estimated bodies                                 report   the tables
"""
