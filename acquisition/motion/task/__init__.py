"""A task as data: named transforms and the equations between them (`transforms`, `graph`), the program that uses them
(`program`), and the TOML file that holds both (`task_file`).
"""
