"""The ablation of IPMAN-R: regressors trained with and without intuitive physics on static people whose truth is known.

variants  what is compared, with settings frozen in settings.yaml      run      training and estimates, kept in a folder
intervals of differences over bodies and seeds                        report   the tables
"""
