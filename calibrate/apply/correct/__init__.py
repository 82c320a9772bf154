"""Commands that bring the real tool to wanted poses, with a model's geometry and physics; in tables and in programs.

`corrected.correct` solves, `corrected.predicted_errors` judges any commands, `tables` reads poses.csv and makes the
rows of corrected.csv, `programs.rewriting.correct_program` changes the literals of a program. Inverse kinematics come
in as an argument: motion has the one that there is. Nothing is imported here: who lists the packages of calibrate does
not want to load the physics.
"""
