"""The commands of `calibeam`, one module each: options, help text, and what is done with them.

A new command is a file here, with its function named as in the others, and a line in calibeam/command_list.py. Nothing
here is imported before its command is called, and what takes long to load is imported where it is used.
"""
